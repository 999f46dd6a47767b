"""The documentation site: `make docs` builds it, `docs.generate` writes what the code knows."""
