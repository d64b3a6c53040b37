/* Every function of the C library that reads or writes at a position. Compiled twice: with and without the checks of
   _FORTIFY_SOURCE, which puts __pread_chk and __pread64_chk in the place of pread and pread64. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/uio.h>
#include <unistd.h>

static unsigned char bytes[2];

static void tell(const char *name, long long done) {
    if (done < 0)
        printf("%s errno %d\n", name, errno);
    else
        printf("%s %lld: %02x %02x\n", name, done, bytes[0], bytes[1]);
    memset(bytes, 0, sizeof bytes);
}

int main(int count, char **arguments) {
    int file = open(arguments[1], O_RDWR);
    if (file < 0 || ioctl(file, 0x0703, 0x69)) return 1;
    volatile size_t length = 2;
    struct iovec into[2] = {{bytes, 1}, {bytes + 1, 1}};
    const off64_t far = 1LL << 40;

    if (pwrite(file, "\x10", 1, 7) != 1) return 2;
    tell("pread", pread(file, bytes, length, 9));
    if (pwrite64(file, "\x20", 1, far) != 1) return 3;
    tell("pread64", pread64(file, bytes, length, far));
    tell("preadv", preadv(file, into, 2, 9));
    tell("preadv64", preadv64(file, into, 2, far));
    tell("preadv2", preadv2(file, into, 2, 9, 0));
    tell("preadv64v2", preadv64v2(file, into, 2, far, 0));
    tell("preadv2 without a position", preadv2(file, into, 2, -1, 0));

    unsigned char out[4][2][2];
    for (int call = 0; call < 4; call++) {
        unsigned char pieces[2][2] = {{0x40 + 8 * call, 0xA0 + call}, {0x44 + 8 * call, 0xB0 + call}};
        memcpy(out[call], pieces, sizeof pieces);
    }
    struct iovec from[4][2];
    for (int call = 0; call < 4; call++)
        for (int piece = 0; piece < 2; piece++)
            from[call][piece] = (struct iovec){out[call][piece], 2};
    tell("pwritev", pwritev(file, from[0], 2, 9));
    tell("pwritev64", pwritev64(file, from[1], 2, far));
    tell("pwritev2", pwritev2(file, from[2], 2, 9, 0));
    tell("pwritev64v2", pwritev64v2(file, from[3], 2, far, 0));

    tell("pread before the start", pread(file, bytes, length, -1));
    tell("pwrite before the start", pwrite(file, bytes, 1, -1));
    tell("preadv before the start", preadv(file, into, 2, -1));
    tell("preadv2 before the start", preadv2(file, into, 2, -2, 0));
    tell("preadv2 that must not wait", preadv2(file, into, 2, 9, RWF_NOWAIT));
    tell("readv of -1 pieces", readv(file, into, -1));
    tell("readv of 1025 pieces", readv(file, into, 1025));
    tell("readv of pieces that are nowhere", readv(file, (struct iovec *)8, 1));
    tell("lseek", lseek(file, 5, SEEK_SET));
    return 0;
}
