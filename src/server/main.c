/* shaded: the daemon. Starts everything, waits for a signal, stops everything in order. */
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/machine.h"
#include "base/regular.h"
#include "server.h"
#include "server/conn/address.h"
#include "server/conn/doors.h"
#include "server/conn/http.h"
#include "server/conn/linger.h"
#include "server/jobs/scene_folder.h"
#include "server/jobs/work.h"
#include "server/ops/admin.h"
#include "server/ops/config.h"
#include "server/ops/descriptors.h"
#include "server/ops/log.h"
#include "server/ops/memory.h"
#include "server/ops/ready.h"
#include "server/ops/settings.h"
#include "server/ops/systemd.h"

enum { EXIT_STOPPED = 0, EXIT_CANNOT_START = 1, EXIT_USAGE = 2 };

/* How long clients that are connected, or still sending their request, are waited for; and
 * cancelled jobs, within the drain time if that is twice as long. */
static const double upload_grace = 1, cancel_grace = 5;

typedef struct ports {
    struct MHD_Daemon *public;
    shd_admin *admin;
    shd_doors *doors; /* where the public port listens */
    int turn;         /* shd_http_turn's, while it is waited for; -1: it is not */
} ports;

/* As many connections as the system allows descriptors for. */
static shd_status claim_descriptors(shd_config *config, shd_error *error) {
    const uint64_t wanted = config->connections;
    shd_status status = shd_descriptors_claim(wanted, &config->connections, error);
    if (status || config->connections == wanted) return status;
    shd_log line;
    shd_log_begin(&line, SHD_LOG_WARNING, "fewer-connections");
    shd_log_whole(&line, "max-connections", config->connections);
    shd_log_text(&line, "message", "the limit of open files has no room for more");
    shd_log_end(&line);
    return SHD_OK;
}

/* Signals are for the main thread alone, which waits for them; threads inherit the mask. */
static sigset_t block_signals(void) {
    sigset_t stop;
    sigemptyset(&stop);
    sigaddset(&stop, SIGHUP);
    sigaddset(&stop, SIGTERM);
    sigaddset(&stop, SIGINT);
    pthread_sigmask(SIG_BLOCK, &stop, NULL);
    signal(SIGPIPE, SIG_IGN);
    /* Sent by mistake, to what others let reopen a log or dump a state: they end nothing. */
    signal(SIGUSR1, SIG_IGN);
    signal(SIGUSR2, SIG_IGN);
    signal(SIGXFSZ, SIG_IGN); /* a log that may not grow any more ends nothing */
    return stop;
}

/* ---- Start ---- */

static shd_status make_engine(shd_server *server, shd_error *error) {
    shd_engine_options options = shd_settings_engine(&server->config);
    options.budget = server->budget;
    shd_status status = shd_engine_new(&options, &server->engine, error);
    if (status) return status;
    server->quotas = shd_quotas_new();
    if (!server->quotas) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    return shd_settings_new(&server->config, server->engine, false, server->quotas,
                            &server->settings, error);
}

static shd_patience patience_of(const shd_config *config) {
    return (shd_patience){.head = (double)config->head_time,
                          .body = (double)config->body_time,
                          .send = (double)config->send_time,
                          .least_reading = 0.5,
                          .connections = config->connections,
                          .each = config->connections_each};
}

/* What was found that bounds this process. */
static void log_machine(const shd_machine *machine) {
    char quota[32];
    shd_log line;
    shd_log_begin(&line, SHD_LOG_INFO, "machine");
    shd_log_whole(&line, "processors", machine->processors);
    if (*machine->quota_source) {
        snprintf(quota, sizeof quota, "%.2f", machine->quota);
        shd_log_text(&line, "cpu-quota", quota);
        shd_log_text(&line, "cpu-quota-by", machine->quota_source);
    }
    if (*machine->memory_source) {
        shd_log_whole(&line, "memory", machine->memory);
        shd_log_text(&line, "memory-by", machine->memory_source);
    }
    shd_log_end(&line);
}

static void log_listening(const shd_server *server, const char *address, const char *admin) {
    shd_log line;
    shd_log_begin(&line, SHD_LOG_INFO, "listening");
    shd_log_text(&line, "address", address);
    shd_log_text(&line, "admin", admin);
    shd_log_text(&line, "version", shd_version());
    shd_log_whole(&line, "threads", shd_engine_load(server->engine).threads);
    shd_log_whole(&line, "pid", (uint64_t)getpid());
    shd_log_end(&line);
}

/* The sockets come first: an address in use is told before the color configuration is read.
 * If one step fails, main() undoes the others. */
static shd_status start_all(shd_server *server, ports *out, shd_error *error) {
    const shd_config *config = &server->config;
    char address[SHD_DOORS_SIZE], admin[SHD_ADDRESS_SIZE] = "off";
    const shd_machine machine = shd_machine_look("");
    shd_sockets given = {.admin = -1};
    shd_status status = shd_memory_open(&machine, config, &server->budget, error);
    if (!status) shd_memory_clip(&server->config, server->budget);
    const shd_patience patience = patience_of(config);
    if (!status) status = shd_take_sockets(&given, error);
    if (!status) status = shd_doors_open(config->listen, given.public, &out->doors, address, error);
    if (!status && given.admin >= 0)
        shd_listen_describe(given.admin, admin);
    else if (!status && strcmp(config->admin, "off") != 0)
        status = shd_listen(config->admin, &given.admin, admin, error);
    if (!status && *config->scenes_folder)
        status =
            shd_scene_folder_open(config->scenes_folder, &server->metrics, &server->scenes, error);
    if (!status) status = make_engine(server, error);
    if (!status)
        status = shd_cache_new(config->response_cache, server->budget, &server->cache, error);
    if (!status) status = shd_server_start_jobs(server, error);
    if (!status) status = shd_linger_new(&server->linger, error);
    if (!status)
        status = shd_reaper_new(&patience, &shd_exchange_departure, &server->reaper, error);
    if (!status) shd_memory_connect(server);
    if (!status && given.admin >= 0) {
        status = shd_admin_start(server, given.admin, &out->admin, error);
        if (!status) given.admin = -1;
    }
    if (!status) status = shd_http_start(server, shd_doors_first(out->doors), &out->public, error);
    if (!status) status = shd_doors_serve(out->doors, out->public, error);
    if (given.admin >= 0) close(given.admin);
    if (!status) {
        log_machine(&machine);
        shd_memory_log(server);
        log_listening(server, address, admin);
    }
    return status;
}

/* ---- Stop ---- */

/* Whether no connection is open or waits to be. */
static bool is_deserted(shd_server *server, const ports *open) {
    shd_reaped count = shd_reaper_count(server->reaper);
    for (int phase = 0; phase < SHD_PHASES; phase++)
        if (count.connections[phase]) return false;
    return !shd_doors_have_waiting(open->doors);
}

/* The same on two looks with a turn of the I/O thread between them: it may just be taking a
 * connection, which then neither waits nor is open yet. */
static bool is_over(shd_server *server, ports *open) {
    struct pollfd turn = {.fd = open->turn, .events = POLLIN};
    bool has_turned = open->turn >= 0;
    if (has_turned && poll(&turn, 1, 0) <= 0) return false;
    if (has_turned) close(open->turn);
    open->turn = -1;
    if (!is_deserted(server, open)) return false;
    if (!has_turned) open->turn = shd_http_turn(open->public);
    return open->turn < 0;
}

/* Returns once nothing that has come is unanswered and no worker has anything to do, or the time is
 * over. False: a job did not end even when it was cancelled, or a second signal came; the process
 * can only be ended. */
static bool drain_requests(shd_server *server, ports *open, const sigset_t *stop) {
    const struct timespec pause = {.tv_nsec = 10 * 1000 * 1000};
    double begin = shd_now(), closed = INFINITY;
    const double drain_time = (double)server->settings->config.drain_time;
    const double deadline = begin + fmax(drain_time - cancel_grace, drain_time / 2);
    bool cancelled = false, gone = false; /* gone: the clients are */
    for (;;) {
        double now = shd_now();
        if (now > deadline && !cancelled) {
            shd_log_message(SHD_LOG_WARNING, "drain-time", "cancelling what is unfinished");
            atomic_store(&server->stopping, true);
            shd_jobs_stop(server->jobs);
            cancelled = true;
        }
        /* Then clients that do not take their answer are not waited for any longer. */
        bool unanswered = atomic_load(cancelled ? &server->suspended : &server->accepted);
        bool uploads_over =
            !atomic_load(&server->in_flight) || now > begin + upload_grace || cancelled;
        if (!unanswered && uploads_over && closed == INFINITY) {
            shd_doors_seal(open->doors);
            shd_reaper_finish(server->reaper, upload_grace);
            closed = now;
        }
        const bool working = shd_engine_load(server->engine).busy;
        gone = gone || (!unanswered && closed < INFINITY && is_over(server, open));
        gone = gone || (!unanswered && cancelled && now > closed + upload_grace);
        if (gone && !working) return true;
        if (now > deadline + cancel_grace) {
            shd_log_message(SHD_LOG_ERROR, "stuck", "a request does not end: giving up");
            return false;
        }
        int number = sigtimedwait(stop, NULL, &pause);
        if (number == SIGTERM || number == SIGINT) {
            shd_log_message(SHD_LOG_WARNING, "second-signal", "stopping at once");
            return false;
        }
    }
}

static void release_all(shd_server *server, ports *open) {
    if (open->turn >= 0) close(open->turn);
    shd_doors_stop(open->doors);
    shd_http_stop(server, open->public);
    shd_doors_drop(open->doors);
    shd_admin_stop(open->admin);
    shd_engine_drop(server->engine);
    shd_reaper_drop(server->reaper);
    shd_linger_drop(server->linger);
    shd_jobs_drop(server->jobs);
    shd_cache_drop(server->cache);
    shd_scene_folder_drop(server->scenes);
    shd_settings_drop(server->settings);
    shd_quotas_drop(server->quotas);
    shd_budget_drop(server->budget);
}

/* ---- While it runs ---- */

/* Makes new settings for new requests. If anything is bad, the old ones stay for all. */
static void reload_settings(shd_server *server, int argc, char **argv) {
    char message[1024] = "", kept[256] = "";
    shd_config config;
    shd_settings *settings;
    shd_error error = {0};
    shd_notify_reloading();
    bool good = shd_config_read(argc, argv, &config, message, sizeof message) == SHD_CONFIG_RUN;
    if (good) {
        shd_memory_clip(&config, server->budget);
        shd_config_keep(&config, &server->config, kept, sizeof kept);
        good = !shd_settings_new(&config, server->engine, true, server->quotas, &settings, &error);
        if (!good)
            snprintf(message, sizeof message, "%s%s%s", error.path, *error.path ? ": " : "",
                     error.text);
    }
    if (good) {
        const shd_patience patience = patience_of(&config);
        shd_server_replace(server, settings);
        shd_reaper_set_patience(server->reaper, &patience);
    }
    atomic_fetch_add(&server->metrics.reloads[good], 1);
    shd_log line;
    shd_log_begin(&line, good ? SHD_LOG_INFO : SHD_LOG_ERROR, good ? "reloaded" : "reload-failed");
    if (*kept) shd_log_text(&line, "needs-restart", kept);
    if (!good) shd_log_text(&line, "message", message);
    shd_log_end(&line);
    shd_notify("READY=1");
}

/* The next signal. Meanwhile memory that is in no use is given back, and the service manager is
 * told that all is well. That is true if the reaper answers, whose lock every connection and job
 * takes in turn. */
static int wait_for_signal(shd_server *server, const sigset_t *signals) {
    const double interval = shd_watchdog_interval();
    const bool is_watched = interval > 0;
    const struct timespec pause =
        shd_timespec(is_watched && interval < SHD_REST_SECONDS ? interval : SHD_REST_SECONDS);
    for (;;) {
        int number = sigtimedwait(signals, NULL, &pause);
        if (number > 0) return number;
        if (errno != EAGAIN) continue;
        shd_memory_rest(server);
        shd_reaper_count(server->reaper);
        if (is_watched) shd_notify("WATCHDOG=1");
    }
}

static int serve_requests(shd_server *server, int argc, char **argv) {
    sigset_t stop = block_signals();
    shd_memory_begin();
    if (getrandom(&server->run, sizeof server->run, 0) != (ssize_t)sizeof server->run)
        server->run = (uint32_t)getpid();

    ports open = {.turn = -1};
    shd_error error = {0};
    if (claim_descriptors(&server->config, &error) || start_all(server, &open, &error)) {
        shd_log line;
        shd_log_begin(&line, SHD_LOG_ERROR, "cannot-start");
        if (*error.path) shd_log_text(&line, "where", error.path);
        shd_log_text(&line, "message", error.text);
        shd_log_end(&line);
        release_all(server, &open);
        return EXIT_CANNOT_START;
    }

    shd_notify("READY=1");
    int signal_number;
    while ((signal_number = wait_for_signal(server, &stop)) == SIGHUP)
        reload_settings(server, argc, argv);
    atomic_store(&server->draining, true);
    shd_log_message(SHD_LOG_INFO, "stopping", strsignal(signal_number));
    shd_notify("STOPPING=1");
    /* Requests whose upload does not end, or whose answer is not taken. */
    uint64_t aborted = atomic_load(&server->metrics.aborted);
    if (!drain_requests(server, &open, &stop)) _exit(EXIT_CANNOT_START);
    release_all(server, &open);
    aborted = atomic_load(&server->metrics.aborted) - aborted;
    char message[64] = "all requests are answered";
    if (aborted)
        snprintf(message, sizeof message, "requests that are not answered: %" PRIu64, aborted);
    shd_log_message(SHD_LOG_INFO, "stopped", message);
    return EXIT_STOPPED;
}

int main(int argc, char **argv) {
    if (!shd_occupy_closed_streams()) return EXIT_CANNOT_START;
    /* Too large for the stack's taste, and needed to the end. */
    shd_server *server = calloc(1, sizeof *server);
    if (!server) return EXIT_CANNOT_START;
    pthread_mutex_init(&server->settings_mutex, NULL);
    char message[1024];
    int code = EXIT_STOPPED;
    const shd_config_result result =
        shd_config_read(argc, argv, &server->config, message, sizeof message);
    switch (result) {
    case SHD_CONFIG_RUN:
        code = serve_requests(server, argc, argv);
        break;
    case SHD_CONFIG_READY:
        code = shd_ask_ready(&server->config) ? EXIT_STOPPED : EXIT_CANNOT_START;
        break;
    case SHD_CONFIG_HELP:
        shd_config_help(stdout);
        break;
    case SHD_CONFIG_VERSION:
        printf("shaded %s\n", shd_version());
        break;
    case SHD_CONFIG_BAD_FLAGS:
    case SHD_CONFIG_BAD:
        fprintf(stderr, "shaded: %s\n", message);
        code = result == SHD_CONFIG_BAD ? EXIT_CANNOT_START : EXIT_USAGE;
    }
    free(server);
    return code;
}
