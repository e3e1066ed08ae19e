// SPDX-License-Identifier: Apache-2.0
// Between boothsim and the spotread that it leaves in its run folder: the
// executable, and what that asks for over the control socket.
#ifndef SIMULATOR_SPOTREAD_LINK_H
#define SIMULATOR_SPOTREAD_LINK_H

#include "base/control.h"
#include "simulator/model_spotread.h"
#include "simulator/wire.h"

// boothsim's side: writes run_dir/spotread, which runs this very program as
// "boothsim --spotread SOCKET ARGUMENT...".
bool spotread_leave(const char *run_dir, struct error *err);
void spotread_take_away(const char *run_dir);

// Adds "spotread" to the answer to a request for radiance: the instrument and
// what befalls it.
void spotread_offer(json_t *answer, const struct spotread_settings *settings, struct wire *wire);

// spotread's side: what there is to see now. *settings may be NULL. False with
// err when nobody answers or the answer is none.
bool spotread_look(struct control_client *client, struct spotread_settings *settings,
                   struct spotread_sight *sight, struct error *err);

#endif
