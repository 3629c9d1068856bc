#!/bin/sh
# What a study is made of: fitting, Richardson's limit, Pareto fronts, the editing of scenes, settings; with made-up numbers.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/study/units.py" "$ROOT"
