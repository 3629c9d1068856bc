#!/bin/bash
#test: long
#test: limit 240
# As shipped.sh, every scene, on 2 ranks.
. "$(dirname "$0")/../harness/env.sh"
export WORK
exec bash "$ROOT/test/regression/shipped.sh" 2
