"""``python -m ccmodel.cli``."""

from ccmodel.cli import main

main()
