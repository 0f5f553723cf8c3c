"""`python -m mrhubo VERB ...` is `mrhubo VERB ...`."""

from mrhubo.cli import main

if __name__ == "__main__":
    main()
