"""Write the generated pages: `python -m docs.generate`."""

from docs import generate
from firstorder import session

if __name__ == "__main__":
    session.start()
    generate.write()
