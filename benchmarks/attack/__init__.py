"""Hostile input to everything that nectosome reads: files, command lines, caches, names, messages, and signals.

An attack is survived where all of this holds:

- the exit code is 2, or 0 where the input is good all the same, and nothing was raised;
- of what is wrong stderr has one line, of at most 1000 characters, that names the file, the field or the option;
  of what is good at most 20 such lines of warnings;
- stdout is empty where something is wrong, and neither has a character that a terminal obeys;
- no file in the folder is new or changed;
- it takes at most 3 s of processor time, 10 s where the input is good, and 300 MB of memory more than before.
"""
