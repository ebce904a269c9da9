#!/usr/bin/env python3
"""The Pareto plot of a study as a picture of its own: pareto.py STUDY.html PLOT.svg"""

import re
import sys

STYLE = """<style>
svg { background: #fff; font-family: sans-serif; }
text { fill: #5d636d; font-size: 13px; }
.x { text-anchor: middle; } .y, .time { text-anchor: end; }
.grid { stroke: #dedcd6; fill: none; } .axis { stroke: #5d636d; fill: none; }
.line { stroke: #3a4f8f; fill: none; stroke-width: 1.6; }
circle { fill: #3a4f8f; } .behind { fill: #8a93a8; }
.best { fill: none; stroke: #9a6200; stroke-width: 2.4; }
.below { fill: #5d636d; opacity: 0.09; }
</style>"""

with open(sys.argv[1], encoding="utf-8") as page:
    plot = re.search(r"<svg .*?</svg>", page.read(), re.DOTALL)
if plot is None:
    sys.exit(f"{sys.argv[1]} has no plot")
head, rest = plot.group(0).split(">", 1)
with open(sys.argv[2], "w", encoding="utf-8") as out:
    out.write(f'{head} xmlns="http://www.w3.org/2000/svg">{STYLE}{rest}\n')
