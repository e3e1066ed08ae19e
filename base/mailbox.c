// SPDX-License-Identifier: Apache-2.0
#include "base/mailbox.h"

#include <stdlib.h>
#include <string.h>

bool mailbox_init(struct mailbox *box, size_t size)
{
    *box = (struct mailbox){.size = size, .value = malloc(size)};
    if (!box->value)
        return false;
    pthread_mutex_init(&box->lock, NULL);
    return true;
}

void mailbox_fini(struct mailbox *box)
{
    if (!box->value)
        return;
    pthread_mutex_destroy(&box->lock);
    free(box->value);
    *box = (struct mailbox){0};
}

void mailbox_post(struct mailbox *box, const void *value)
{
    pthread_mutex_lock(&box->lock);
    memcpy(box->value, value, box->size);
    box->sent++;
    pthread_mutex_unlock(&box->lock);
}

uint64_t mailbox_read(struct mailbox *box, void *value)
{
    pthread_mutex_lock(&box->lock);
    uint64_t sent = box->sent;
    if (sent)
        memcpy(value, box->value, box->size);
    pthread_mutex_unlock(&box->lock);
    return sent;
}
