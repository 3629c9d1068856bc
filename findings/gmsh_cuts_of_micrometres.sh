#!/bin/sh
# Gmsh 4.15.2: a cut of bodies of one or two micrometres in metres gives bodies of other volumes, and says
# nothing.
#
# Who is bitten: who models an imprint, a tip, a film or a pillar in metres, as simulation codes want them,
#       with the OpenCASCADE kernel (addBox, addSphere, cut), and meshes it or writes its surface as STL.
# A good guess: the shape does not depend on the unit, down to the kernel's tolerance of 1e-7 (Gmsh's own
#       Geometry.Tolerance is 1e-8), and a call that cannot tell two faces apart fails.
# Seen: what is left of a cube, as a share. A ball cut from its upper face leaves .9152 at edges of 1, 1e-3,
#       1e-5 and 5e-6 m, 1.0241 at 2e-6 (more than the cube) and .6330 at 1e-6. A pocket leaves .98; at 2e-6
#       the whole cube and a second body of negative volume, at 1e-6 the whole cube. A hole through it leaves
#       .7173, at 1e-6 .6667. No exception in any of these; smaller ones end in one or in a volume of 0.
# Instead: model in micrometres and scale the mesh (Mesh.ScalingFactor), and compare getMass with what it has
#       to be.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check gmsh==4.15.2
cat >"$dir/cut.py" <<'END'
import sys

import gmsh

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
occ = gmsh.model.occ
tools = {
    "ball": lambda s: occ.addSphere(0.5 * s, 0.5 * s, 1.1 * s, 0.4 * s),
    "pocket": lambda s: occ.addBox(0.4 * s, 0.4 * s, 0.5 * s, 0.2 * s, 0.2 * s, s),
    "hole": lambda s: occ.addCylinder(0.5 * s, 0.5 * s, -0.5 * s, 0, 0, 2 * s, 0.3 * s),
}


def left(tool, edge):
    gmsh.clear()
    cube = occ.addBox(0, 0, 0, edge, edge, edge)
    bodies, _ = occ.cut([(3, cube)], [(3, tools[tool](edge))])
    occ.synchronize()
    return [occ.getMass(*body) / edge**3 for body in bodies]


print("Gmsh", gmsh.__version__, "- share of the cube that is left, a number for each body:")
found = {}
for tool in tools:
    for edge in (1.0, 1e-3, 1e-5, 5e-6, 2e-6, 1e-6):
        found[tool, edge] = left(tool, edge)
        print(f"{tool} cut from a cube of {edge:g} m:", *(f"{share:.4f}" for share in found[tool, edge]))
gmsh.finalize()
right = {"ball": 0.91518, "pocket": 0.98, "hole": 0.71726}
large = [(tool, edge) for tool in right for edge in (1.0, 1e-3, 1e-5, 5e-6)]
good = all(abs(sum(found[t, e]) - right[t]) < 1e-4 and len(found[t, e]) == 1 for t, e in large)
off = [("ball", 2e-6), ("ball", 1e-6), ("pocket", 2e-6), ("pocket", 1e-6), ("hole", 1e-6)]
bad = all(abs(sum(found[t, e]) - right[t]) > 0.01 for t, e in off)
sys.exit(0 if good and bad else "this version does otherwise")
END
cd "$dir"
status=0
venv/bin/python cut.py >said || status=$?
grep '^Gmsh\|cut from' said # Open CASCADE may print of its own
exit $status
