"""Storage for data that must not be lost: appended to a file with checksums, and on disk before it is confirmed."""

from smartshoe.files.journal._appending import AppendedFile
from smartshoe.files.journal._journal import Contents, Journal, read_journal
from smartshoe.files.journal._records import Record

__all__ = ["AppendedFile", "Contents", "Journal", "Record", "read_journal"]
