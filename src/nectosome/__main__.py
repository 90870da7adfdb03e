"""`python -m nectosome`, the same as the command `nectosome`."""

import sys

from nectosome.cli import main

sys.exit(main())
