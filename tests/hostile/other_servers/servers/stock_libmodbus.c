/* Server of libmodbus with 200 registers, coils and inputs each, one thread and select: stock_libmodbus PORT */
#include <modbus.h>
#include <stdlib.h>
#include <sys/select.h>
#include <unistd.h>

enum { SIZE = 200, BACKLOG = 128 };

int main(int count, char **words)
{
    if (count < 2)
        return 2;
    modbus_t *line = modbus_new_tcp("127.0.0.1", atoi(words[1]));
    modbus_mapping_t *map = modbus_mapping_new(SIZE, SIZE, SIZE, SIZE);
    int listener = modbus_tcp_listen(line, BACKLOG);
    fd_set open, ready;
    FD_ZERO(&open);
    FD_SET(listener, &open);
    for (;;) {
        ready = open;
        if (select(FD_SETSIZE, &ready, NULL, NULL, NULL) < 0)
            return 1;
        for (int fd = 0; fd < FD_SETSIZE; fd++) {
            if (!FD_ISSET(fd, &ready))
                continue;
            if (fd == listener) {
                int client = modbus_tcp_accept(line, &listener);
                if (client >= FD_SETSIZE)
                    close(client);
                else if (client >= 0)
                    FD_SET(client, &open);
                continue;
            }
            uint8_t request[MODBUS_TCP_MAX_ADU_LENGTH];
            modbus_set_socket(line, fd);
            int size = modbus_receive(line, request);
            if (size > 0)
                modbus_reply(line, request, size, map);
            else if (size < 0) {
                close(fd);
                FD_CLR(fd, &open);
            }
        }
    }
}
