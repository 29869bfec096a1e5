/* Client with libmodbus: libmodbus tcp PORT, or rtu DEVICE.
 * One request per input line, one line of JSON per answer. */
#include <errno.h>
#include <modbus.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_ARGUMENTS = 8 };

static modbus_t *bus;
static uint16_t words[MODBUS_MAX_READ_REGISTERS];
static uint8_t bits[MODBUS_MAX_READ_BITS];
static char *argument[MAX_ARGUMENTS];
static int arguments;

static int number(int at) { return at < arguments ? atoi(argument[at]) : 0; }
static int low_word_first(int at) { return strcmp(argument[at], "CDAB") == 0; }

static int print_words(int count)
{
    for (int i = 0; i < count; i++)
        printf("%s%d", i ? ", " : "", words[i]);
    return count;
}

static int read_words(void)
{
    int function = number(1), address = number(2), count = number(3);
    return print_words(function == 3 ? modbus_read_registers(bus, address, count, words)
                                     : modbus_read_input_registers(bus, address, count, words));
}

static int read_bits(void)
{
    int function = number(1), address = number(2), count = number(3);
    int got = function == 1 ? modbus_read_bits(bus, address, count, bits)
                            : modbus_read_input_bits(bus, address, count, bits);
    for (int i = 0; i < got; i++)
        printf("%s%d", i ? ", " : "", bits[i]);
    return got;
}

static int read_float(void)
{
    int got = modbus_read_registers(bus, number(1), 2, words);
    if (got > 0)
        printf("%.9g", low_word_first(2) ? modbus_get_float_cdab(words) : modbus_get_float_abcd(words));
    return got;
}

/* modbus_set_float_abcd is not used: it also swaps the bytes of each word (libmodbus issues 757, 807). */
static int write_float(void)
{
    modbus_set_float(strtof(argument[2], NULL), words);
    if (!low_word_first(3)) {
        uint16_t low = words[0];
        words[0] = words[1];
        words[1] = low;
    }
    return modbus_write_registers(bus, number(1), 2, words);
}

static int write_word(void) { return modbus_write_register(bus, number(1), number(2)); }

static int write_words(void)
{
    for (int i = 2; i < arguments; i++)
        words[i - 2] = number(i);
    return modbus_write_registers(bus, number(1), arguments - 2, words);
}

static int write_coil(void) { return modbus_write_bit(bus, number(1), number(2)); }

static int write_coils(void)
{
    for (int i = 2; i < arguments; i++)
        bits[i - 2] = number(i);
    return modbus_write_bits(bus, number(1), arguments - 2, bits);
}

static int mask(void) { return modbus_mask_write_register(bus, number(1), number(2), number(3)); }

static int exchange(void)
{
    uint16_t written = number(4);
    return print_words(
        modbus_write_and_read_registers(bus, number(3), 1, &written, number(1), number(2), words));
}

static int server_id(void) { return modbus_report_slave_id(bus, MODBUS_MAX_PDU_LENGTH, bits); }

static const struct {
    const char *name;
    int (*carry_out)(void);
} REQUESTS[] = {
    {"words", read_words},
    {"bits", read_bits},
    {"float", read_float},
    {"float_write", write_float},
    {"word_write", write_word},
    {"words_write", write_words},
    {"coil_write", write_coil},
    {"coils_write", write_coils},
    {"mask", mask},
    {"exchange", exchange},
    {"server_id", server_id},
};

static void carry_out(void)
{
    for (size_t i = 0; i < sizeof REQUESTS / sizeof *REQUESTS; i++) {
        if (strcmp(REQUESTS[i].name, argument[0]) != 0)
            continue;
        printf("[");
        if (REQUESTS[i].carry_out() >= 0)
            printf("]\n");
        else if (errno > MODBUS_ENOBASE && errno < MODBUS_ENOBASE + MODBUS_EXCEPTION_MAX)
            printf("\"exception\", %d]\n", errno - MODBUS_ENOBASE);
        else
            printf("\"error\", \"%s\"]\n", modbus_strerror(errno));
    }
    fflush(stdout);
}

int main(int count, char **given)
{
    static char line[1000];
    if (count != 3)
        return 2;
    bus = strcmp(given[1], "tcp") == 0 ? modbus_new_tcp("127.0.0.1", atoi(given[2]))
                                       : modbus_new_rtu(given[2], 19200, 'N', 8, 2);
    modbus_set_slave(bus, 1);
    modbus_set_response_timeout(bus, 5, 0);
    if (modbus_connect(bus) != 0)
        return 1;
    while (fgets(line, sizeof line, stdin)) {
        arguments = 0;
        for (char *word = strtok(line, " \n"); word && arguments < MAX_ARGUMENTS; word = strtok(NULL, " \n"))
            argument[arguments++] = word;
        if (arguments)
            carry_out();
    }
    modbus_close(bus);
    modbus_free(bus);
    return 0;
}
