/* Modbus TCP clients that read all the time: load PORT CLIENTS SECONDS [HZ]. The program prints one JSON line.
 *
 * Each client is a thread with its own connection. It reads input registers 0 to 19 at HZ. Without HZ, it sends
 * a request as soon as it has received the previous answer. */
#include <errno.h>
#include <modbus.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { REGISTERS = 20, MOST_TRIPS = 4000000, NS_PER_S = 1000000000 };

struct client {
    pthread_t thread;
    int port;
    double first_s, period_s, until_s;
    float *trips_ms;
    int most, trips, failures;
};

static double now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec / NS_PER_S;
}

static void sleep_until(double due_s)
{
    struct timespec due = {(time_t)due_s, (long)((due_s - (double)(time_t)due_s) * NS_PER_S)};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL) == EINTR) {
    }
}

static void *run(void *argument)
{
    struct client *own = argument;
    uint16_t words[REGISTERS];
    modbus_t *line = modbus_new_tcp("127.0.0.1", own->port);
    modbus_set_response_timeout(line, 5, 0);
    if (modbus_connect(line) != 0) {
        own->failures = 1;
        modbus_free(line);
        return NULL;
    }
    for (double due_s = own->first_s; due_s < own->until_s && own->trips < own->most;) {
        if (own->period_s > 0)
            sleep_until(due_s);
        double begun_s = now_s();
        if (modbus_read_input_registers(line, 0, REGISTERS, words) != REGISTERS) {
            own->failures++;
            break;
        }
        double ended_s = now_s();
        own->trips_ms[own->trips++] = (float)((ended_s - begun_s) * 1e3);
        due_s = own->period_s > 0 ? due_s + own->period_s : ended_s;
    }
    modbus_close(line);
    modbus_free(line);
    return NULL;
}

static int by_size(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

int main(int count, char **words)
{
    if (count < 4)
        return 2;
    int clients = atoi(words[2]);
    double seconds = atof(words[3]), period_s = count > 4 ? 1 / atof(words[4]) : 0;
    double begun_s = now_s() + 0.1;
    struct client *all = calloc((size_t)clients, sizeof *all);
    for (int i = 0; i < clients; i++) {
        all[i] = (struct client){
            .port = atoi(words[1]),
            .first_s = begun_s + period_s * i / clients,
            .period_s = period_s,
            .until_s = begun_s + seconds,
            .most = MOST_TRIPS / clients,
            .trips_ms = malloc(MOST_TRIPS / (size_t)clients * sizeof(float)),
        };
        pthread_create(&all[i].thread, NULL, run, &all[i]);
    }
    int trips = 0, failures = 0;
    float *trips_ms = malloc(MOST_TRIPS * sizeof *trips_ms);
    for (int i = 0; i < clients; i++) {
        pthread_join(all[i].thread, NULL);
        failures += all[i].failures;
        for (int n = 0; n < all[i].trips && trips < MOST_TRIPS; n++)
            trips_ms[trips++] = all[i].trips_ms[n];
    }
    qsort(trips_ms, (size_t)trips, sizeof *trips_ms, by_size);
    printf("{\"requests_per_s\": %.0f, \"p50_ms\": %.4f, \"p99_ms\": %.4f, \"worst_ms\": %.3f, "
           "\"trips\": %d, \"failures\": %d}\n",
           trips / seconds, trips ? trips_ms[trips / 2] : 0, trips ? trips_ms[(int)(trips * 0.99)] : 0,
           trips ? trips_ms[trips - 1] : 0, trips, failures);
    return failures != 0;
}
