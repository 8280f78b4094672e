"""The command line as `python -m activesteer`."""

import sys

from activesteer.commands.cli import main

sys.exit(main())
