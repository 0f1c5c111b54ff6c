"""``python -m smartshoe``."""

from smartshoe.cli import main

main()
