import ctypes, errno, fcntl, os


class Message(ctypes.Structure):
    _fields_ = [("addr", ctypes.c_uint16), ("flags", ctypes.c_uint16), ("len", ctypes.c_uint16), ("buf", ctypes.c_void_p)]


class Transfer(ctypes.Structure):
    _fields_ = [("msgs", ctypes.POINTER(Message)), ("nmsgs", ctypes.c_uint32)]


def rdwr(file, messages):
    """I2C_RDWR of (address, flags, bytes); returns the count and the buffers afterwards."""
    buffers = [ctypes.create_string_buffer(data, len(data)) for _, _, data in messages]
    array = (Message * len(messages))(
        *[(a, flags, len(data), ctypes.addressof(b)) for (a, flags, data), b in zip(messages, buffers)]
    )
    count = fcntl.ioctl(file, 0x0707, Transfer(array, len(messages)))
    return count, [b.raw for b in buffers]


