"""Command line: python -m gaitswarm"""

from gaitswarm.cli.main import main

main()
