"""python -m gimp3d: the same as gimp3d-post."""

import sys

from .commands import main

sys.exit(main())
