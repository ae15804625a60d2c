"""`python -m charnerf` is the command `charnerf`."""

from charnerf.cli import main

if __name__ == "__main__":
    main()
