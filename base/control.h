// SPDX-License-Identifier: Apache-2.0
// The control socket: one JSON object a line each way over a Unix stream
// socket. Its client and its message names stand here once, for boothctl,
// boothcal and boothsim alike.
//
// Request:  {"do": NAME, ...}        Reply: {"ok": true, ...}
//                                        or {"ok": false, "code": CODE, "error": TEXT}
#ifndef BASE_CONTROL_H
#define BASE_CONTROL_H

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>

#include "base/error.h"

// boothd. Units in field names; see boothctl(1) for every field.
#define CONTROL_STATUS "status"   // -> everything believed now
#define CONTROL_SHOW "show"       // material, [patch] -> frame shown when the reply comes
#define CONTROL_PATCH "patch"     // rgb [R, G, B] in 0..1 of full code, undithered
#define CONTROL_CAPTURE "capture" // file .png (counts) or .exr (XYZ, cd/m2)
#define CONTROL_MEASURE "measure" // -> XYZ cd/m2, spectrum, instrument, age
#define CONTROL_PROBE "probe"     // x_px, y_px -> reference XYZ and counts of that pixel
#define CONTROL_TEACH "teach"     // lamp, readings -> averaged spectrum of the lamp now on
#define CONTROL_RAW "raw"         // [integration_us], readings -> raw counts of the spectrometer
#define CONTROL_RELOAD "reload"   // load display, lamps and booth settings again
#define CONTROL_QUIT "quit"

// boothsim: what a person does in a real booth.
#define CONTROL_LAMP "lamp" // name or "none", [level 0..1.2]
#define CONTROL_TILT "tilt" // deg
#define CONTROL_HEAD "head" // eye_m [x, y, z] in booth frame
#define CONTROL_AIM "aim"   // target "screen" x_px y_px | "ceiling" x_m z_m
#define CONTROL_TRUTH                                                                              \
    "truth" // reflectance {nm, values} or flat -> XYZ a physical sample would show
#define CONTROL_FAULT "fault"           // instrument, kind
#define CONTROL_PROTRACTOR "protractor" // -> deg, the screen's tilt as a protractor reads it
#define CONTROL_TAPE "tape"             // x_m, y_m on the screen -> point_m as a tape measures it
#define CONTROL_PHOTOGRAPH "photograph" // folder -> an exposure series of the ceiling in it
#define CONTROL_RADIANCE "radiance"     // -> what a radiometer aimed there sees, W m-2 sr-1 nm-1

struct control_client;

// Connects to a socket. Error GONE when nobody listens there. NULL on failure.
struct control_client *control_connect(const char *path, struct error *err);

// Accepts NULL.
void control_close(struct control_client *client);

// Sends request (stolen) and waits for its reply until timeout_ms have passed.
// Returns the reply object of an "ok": true answer, to be json_decref'd; NULL
// with err filled from the answer's own code and text otherwise: RETRY when no
// reply came in time (a late one is not taken for the next call's), GONE when
// the connection is lost. One thread.
json_t *control_call(struct control_client *client, json_t *request, int timeout_ms,
                     struct error *err);

// A server's side. handle returns a new reply object (without "ok"), or NULL
// with err filled. It runs on the thread that calls control_serve.
typedef json_t *control_handler(void *context, const char *what, json_t *request,
                                struct error *err);

struct control_server;

// Listens at path (an old socket file that nobody serves is replaced; mode
// 0600); a plain file or a served socket there is left alone (CONFIG). At most
// 16 clients; one more takes the place of the one that has been idle longest,
// when that is 10 s, else it is told RETRY; a line longer than 1 MiB ends its
// connection; a line that is no request is answered with DATA.
struct control_server *control_listen(const char *path, struct error *err);
void control_unlisten(struct control_server *server);

// How long a client may be idle while others wait for a place, instead of 10 s.
void control_idle_after(struct control_server *server, int64_t idle_ns);

// Waits at most timeout_ms for input, answers every complete line, returns.
// False only when polling itself fails.
bool control_serve(struct control_server *server, int timeout_ms, control_handler *handle,
                   void *context, struct error *err);

// For a handler that cannot answer at once: returns a ticket (never 0) for the
// request it is handling and then returns NULL. The client's further lines
// wait meanwhile; other clients do not. 0 outside a handler.
uint64_t control_later(struct control_server *server);

// The answer to a ticket, from the thread that calls control_serve: reply
// (stolen), or NULL with err filled. Forgotten when the client has gone.
void control_answer(struct control_server *server, uint64_t ticket, json_t *reply,
                    const struct error *err);

#endif
