"""The frame in one burst, by the libraries below the drivers. Argument: smbus2 | pureio."""

import sys

import bus

ADDRESS = 0x69


def signed(word):
    word &= 0xFFF
    return (word - 0x1000 if word & 0x800 else word) / 4


def by_smbus2():
    from smbus2 import SMBus, i2c_msg

    with SMBus(1) as smbus:
        write, read = i2c_msg.write(ADDRESS, [0x80]), i2c_msg.read(ADDRESS, 128)
        smbus.i2c_rdwr(write, read)
        return list(read)


def by_pureio():
    from Adafruit_PureIO.smbus import SMBus

    with SMBus(1) as smbus:
        return list(smbus.read_i2c_block_data(ADDRESS, 0x80, 128))


words = by_pureio() if sys.argv[1] == "pureio" else by_smbus2()
pixels = [signed(low | high << 8) for low, high in zip(words[::2], words[1::2])]
bus.answer(frame=[pixels[row * 8 : row * 8 + 8] for row in range(8)], high_nibbles=max(words[1::2]) >> 4)
