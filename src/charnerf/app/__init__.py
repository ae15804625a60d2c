"""The page of `charnerf app`: drawings dropped on it become a character that is looked at, turned and taken away.

The server (`server.py`) computes nothing: one process reads drawings (`recognizer.py`), and each character is made in a process of
its own (`builder.py`), which a cancel ends and whose memory goes back with it.
"""
