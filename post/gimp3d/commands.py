"""The command gimp3d-post: each of its subcommands is the `main` of a module here."""

import importlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

COMMANDS = {
    "plots": "load_depth.png, section.png, energy.png of a run",
    "report": "one page about a run, complete in itself",
    "hardness": "hardness, modulus, pile-up of an indentation",
    "error_bar": "error bars of hardness and modulus, from several runs",
    "identify": "from measured load-depth curves to the material, with intervals",
    "study": "what the accuracy of a scene costs",
    "solve": "the cheapest settings of a scene that have an error",
    "paraview": "the scene of a run for ParaView, and a picture of it",
    "closeup": "the imprint for a talk, beside the load over depth, with hardness and modulus",
    "movie": "an animation of a run: its section beside the load over depth",
    "tool_surface": "the tools of a run as surfaces for ParaView",
    "pole_figure": "the texture of the crystals of a run",
    "gallery": "a page of all shipped scenes with their reports",
    "benchmarks": "the book of benchmarks",
    "heights": "a map for scenes of a microscope's file (.gwy)",
    "surfaces": "spheres, cones, dies as STL files for scenes",
}


class Console:
    """A stream that outlives its reader: what is printed after that (`| head`) goes nowhere, and the command
    goes on to its files."""

    def __init__(self, stream):
        self.stream = stream

    def __getattr__(self, name):
        return getattr(self.stream, name)

    def write(self, text):
        return self._try(self.stream.write, text)

    def flush(self):
        self._try(self.stream.flush)

    def _try(self, action, *arguments):
        try:
            return action(*arguments)
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), self.stream.fileno())
            return 0


def usage():
    lines = ["usage: gimp3d-post COMMAND [options] ...", ""]
    lines += [f"   {name:<14} {what}" for name, what in COMMANDS.items()]
    lines += [f"   {'completion':<14} for bash: eval \"$(gimp3d-post completion)\""]
    lines += ["", "gimp3d-post COMMAND --help lists the options of a command."]
    return "\n".join(lines)


def in_paraview(arguments):
    """paraview_scene.py in ParaView's own Python, without a window where there is no display: its status."""
    pvpython = shutil.which("pvpython")
    if not pvpython:
        print("ParaView is not there: apt-get install paraview python3-paraview", file=sys.stderr)
        return 1
    module = Path(__file__).with_name("paraview_scene.py")
    paths = [str(module.parents[1]), os.environ.get("PYTHONPATH", "")]
    command = [pvpython, str(module), *arguments]
    if not os.environ.get("DISPLAY") and shutil.which("xvfb-run"):
        command = ["xvfb-run", "-a", *command]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))}
    return subprocess.run(command, env=environment).returncode


COMPLETION = """_gimp3d_post() {{
   local word=${{COMP_WORDS[COMP_CWORD]}}
   if [ "$COMP_CWORD" -eq 1 ]; then
      COMPREPLY=($(compgen -W "{names}" -- "$word"))
   else
      COMPREPLY=($(compgen -d -- "$word") $(compgen -f -X '!*.nml' -- "$word"))
   fi
}}
complete -o filenames -F _gimp3d_post gimp3d-post"""


def main(arguments=None):
    """Run a subcommand: its exit status; 2 and one sentence if there is no such command."""
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    if not arguments or arguments[0] in ("-h", "--help", "help"):
        print(usage())
        return 0 if arguments else 2
    if arguments[0] == "completion":
        print(COMPLETION.format(names=" ".join(COMMANDS)))
        return 0
    name = arguments[0].replace("-", "_")
    if name not in COMMANDS:
        names = ", ".join(COMMANDS)
        print(f"gimp3d-post: there is no command {arguments[0]!r}; the commands are {names}", file=sys.stderr)
        return 2
    if name == "paraview":
        return in_paraview(arguments[1:])
    sys.argv = [f"gimp3d-post {name}", *arguments[1:]]
    before, sys.stdout = sys.stdout, Console(sys.stdout)
    try:
        return importlib.import_module(f".{name}", __package__).main()
    finally:
        sys.stdout.flush()
        sys.stdout = before


if __name__ == "__main__":
    sys.exit(main())
