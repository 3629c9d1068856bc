"""What runs of gimp3d wrote, as Python has it: see `gimp3d-post --help`."""
