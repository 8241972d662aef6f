"""`python -m catheter_sim`: the command line."""

import sys

from catheter_sim.cli.main import main

sys.exit(main())
