"""The program cache: traced and compiled programs, kept on disk and in memory; `docs/develop/programs.md` says how."""
