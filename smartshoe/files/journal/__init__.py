"""Data that must not be lost: appended to a file, checked, on disk before anyone learns of it."""

from smartshoe.files.journal._appending import AppendedFile
from smartshoe.files.journal._journal import Contents, Journal, read_journal
from smartshoe.files.journal._records import Record

__all__ = ["AppendedFile", "Contents", "Journal", "Record", "read_journal"]
