"""Reads students' Python scripts, under ROS's own Python: `syntax.py` what does not parse, `slips.py` what does.

The modules import each other by their own names, as they have to where `syntax.py` is run as a script.
"""

import os
import sys

sys.path.append(os.path.dirname(os.path.abspath(__file__)))
