#!/bin/bash
#test: limit 200
#test: beside
# A free block against a standing, frictionless tool, and one between two for 12 000 steps: nobody does work, so the
# energy of the block never rises, and the condition of contact itself gives none (doc/developer/theory.md, eq.
# carried-gap). Negative control: a judge that is given a rising energy says so.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/contact/energy.py" cylinder slope quarter_speed viscoelastic rattling squeezed
