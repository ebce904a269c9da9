#!/usr/bin/env python3
"""Pictures of a run's report as PNG files.

Usage: pictures.py RESULTS VIEW OUTPUT   VIEW: three-quarter, front, side, back or top
"""
import base64
import re
import sys
from pathlib import Path

results, view, output = sys.argv[1:]
page = (Path(results) / "report.html").read_text()
pattern = rf'class="picture {re.escape(view)}"><img alt="shaded[^"]*"[^>]*src="data:image/png;base64,([^"]+)"'
found = re.search(pattern, page)
if not found:
    sys.exit(f"{results}: no picture of the {view} view")
Path(output).write_bytes(base64.b64decode(found.group(1)))
