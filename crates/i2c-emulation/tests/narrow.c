/* The calls of a 32-bit program on x86, without a C library: open, I2C_SLAVE, write, dup, read, I2C_RDWR, statx. */
typedef unsigned int u32;
typedef unsigned short u16;

static long call(long number, long a, long b, long c, long d, long e) {
    long done;
    __asm__ volatile("int $0x80" : "=a"(done) : "a"(number), "b"(a), "c"(b), "d"(c), "S"(d), "D"(e) : "memory");
    return done;
}

struct message { u16 address, flags, length; unsigned char *buffer; };
struct transfer { struct message *messages; u32 count; };

static int run(const char *path) {
    int file = call(5, (long)path, 2, 0, 0, 0);
    if (file < 0) return 1;
    if (call(54, file, 0x0703, 0x69, 0, 0)) return 2;
    if (call(4, file, (long)"\x10zyrs", 5, 0, 0) != 5) return 3;
    if (call(4, file, (long)"\x10", 1, 0, 0) != 1) return 4;
    int copy = call(41, file, 0, 0, 0, 0);
    unsigned char bytes[10] = {0};
    if (copy == file || call(3, copy, (long)bytes, 2, 0, 0) != 2) return 5;
    unsigned char pointer = 0x12;
    struct message messages[2] = {{0x69, 0, 1, &pointer}, {0x69, 1, 2, bytes + 2}};
    struct transfer transfer = {messages, 2};
    if (call(54, file, 0x0707, (long)&transfer, 0, 0) != 2) return 6;
    u32 functions[2] = {0, 7};
    if (call(54, file, 0x0705, (long)functions, 0, 0) || functions[0] != 0x0EFF0009 || functions[1] != 7) return 7;
    u32 attributes[64] = {0};
    if (call(383, -100, (long)path, 0, 0x7ff, (long)attributes) || attributes[32] != 89) return 8;
    for (int n = 0; n < 6; n++) bytes[4 + n] = " done\n"[n];
    call(4, 1, (long)bytes, 10, 0, 0);
    return 0;
}

__attribute__((used)) static void begin(long *stack) { call(1, run((const char *)stack[2]), 0, 0, 0, 0); }
__asm__(".globl _start\n_start: mov %esp, %eax\n push %eax\n call begin\n");
