"""What the coarse grids of the book of benchmarks gave, within bounds. usage: benchmarks_bounds.py FILE"""

import json
import sys

BOUNDS = {}
