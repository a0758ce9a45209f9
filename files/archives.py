"""What Python raises of damaged zip archives and of the arrays in them."""

import struct
import tokenize
import zipfile
import zlib

#: Besides ValueError and RuntimeError (encrypted, or packed in an unknown way), which readers raise
#: themselves. numpy reads the head of an array as Python; errors of XML are a SyntaxError.
DAMAGED_ARCHIVE = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    SyntaxError,
    tokenize.TokenError,
    LookupError,
    EOFError,
    OSError,
)
