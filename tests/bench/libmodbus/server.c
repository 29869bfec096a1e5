/* libmodbus's own server, as its examples have it: one thread, select, constant registers. server PORT */
#include <modbus.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/select.h>
#include <unistd.h>

int main(int count, char **words)
{
    if (count < 2)
        return 2;
    modbus_t *line = modbus_new_tcp("127.0.0.1", atoi(words[1]));
    modbus_mapping_t *map = modbus_mapping_new(0, 32, 1000, 1000);
    int listener = modbus_tcp_listen(line, 128), most = listener;
    fd_set open, ready;
    FD_ZERO(&open);
    FD_SET(listener, &open);
    puts("ready");
    fflush(stdout);
    for (;;) {
        ready = open;
        if (select(most + 1, &ready, NULL, NULL, NULL) < 0)
            return 1;
        for (int fd = 0; fd <= most; fd++) {
            uint8_t request[MODBUS_TCP_MAX_ADU_LENGTH];
            if (!FD_ISSET(fd, &ready))
                continue;
            if (fd == listener) {
                int client = modbus_tcp_accept(line, &listener);
                FD_SET(client, &open);
                most = client > most ? client : most;
                continue;
            }
            modbus_set_socket(line, fd);
            int length = modbus_receive(line, request);
            if (length > 0)
                modbus_reply(line, request, length, map);
            else if (length < 0) {
                close(fd);
                FD_CLR(fd, &open);
            }
        }
    }
}
