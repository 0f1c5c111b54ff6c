"""``python -m smartshoe.cli``."""

from smartshoe.cli import main

main()
