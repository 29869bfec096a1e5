/* The pressure control: the state machine at work, sample by sample.
 * On shutdown: the next boot begins unarmed and SAFE; nothing inflates until VENT and then HOLD is said. */
#ifndef PRESSURE_H
#define PRESSURE_H

#include "limits.h"

#define MOST_CHANGES 8u
#define NEVER (-1)
/* Divided by, not multiplied with its inverse: the edges of spans stay what they are in decimals. */
#define PA_PER_KPA 1000.0f

/* A state entered, or a fault latched. */
struct change {
    uint8_t state;
    uint8_t was;
    uint8_t fault;
};

/* Obeys commands, keeps to the limits, drives the valves. */
struct pressure {
    struct situation now;
    struct change changes[MOST_CHANGES]; /* not yet told to the host */
    uint8_t change_count;
    bool armed; /* VENT was obeyed since boot, trip, greeting, vent message or silence while empty */
    int16_t clear; /* last `clear` seen; the first one is the reference */
    float wanted_kpa; /* 0: nothing is wanted */
    uint8_t broken[LIMIT_COUNT];
};

static void note_change(struct pressure *p, uint8_t was, uint8_t fault)
{
    struct change change = {p->now.state, was, fault};

    if (p->change_count < MOST_CHANGES)
        p->changes[p->change_count++] = change;
}

/* Follow the table; false where the state's row does not name this. */
static bool happen(struct pressure *p, uint8_t happening, uint8_t fault)
{
    uint8_t was = p->now.state, state = TRANSITIONS[was][happening], n;

    if (state == STAYS)
        return false;
    p->now.state = state;
    for (n = 0; n < LIMIT_COUNT; n++)
        if (!among(LIMITS[n].states, state))
            p->broken[n] = 0;
    if (!among(PRESSURISED_STATES, state)) {
        p->now.setpoint_kpa = 0.0f;
        filling_lock(&p->now.filling);
    }
    note_change(p, was, fault);
    return true;
}

static void trip(struct pressure *p, uint8_t fault)
{
    p->armed = false;
    p->wanted_kpa = 0.0f;
    p->now.latched[p->now.latched_count++] = fault;
    if (!happen(p, HAPPENS_TRIPPED, fault))
        note_change(p, p->now.state, fault);
}

/* As it is at boot; `unasked` where watchdog or brown-out restarted the board. */
static void pressure_begin(struct pressure *p, bool unasked)
{
    memset(p, 0, sizeof *p);
    situation_begin(&p->now);
    p->clear = NEVER;
    if (unasked)
        trip(p, FAULT_WATCHDOG);
}

/* A host has greeted, perhaps another: what the one before armed, zeroed and cleared is void. */
static void greet(struct pressure *p)
{
    p->armed = false;
    p->clear = NEVER;
    happen(p, HAPPENS_GREETED, FAULT_NONE);
    if (!among(PRESSURISED_STATES, p->now.state))
        set_zero(&p->now.reading, 0.0f, false);
}

/* Vent, from any state. */
static void vent(struct pressure *p)
{
    p->armed = false;
    p->wanted_kpa = 0.0f;
    happen(p, HAPPENS_VENT_ASKED, FAULT_NONE);
}

/* A new value clears what is gone. No valve moves: TRIPPED and VENTING are both SAFE. */
static void clear_faults(struct pressure *p, uint8_t clear)
{
    struct situation *now = &p->now;
    bool is_new = p->clear != NEVER && p->clear != clear;
    uint8_t n, left = 0;

    p->clear = clear;
    if (!is_new)
        return;
    for (n = 0; n < now->latched_count; n++)
        if (!cause_gone(now, now->latched[n]))
            now->latched[left++] = now->latched[n];
    now->latched_count = left;
    if (!left)
        happen(p, HAPPENS_CLEARED, FAULT_NONE);
}

static uint16_t within(uint16_t value, uint16_t least, uint16_t most)
{
    return value < least ? least : value > most ? most : value;
}

/* Take over what the host wants. */
static void obey(struct pressure *p, const struct command *c)
{
    struct situation *now = &p->now;
    bool zeroed = (c->flags & FLAG_ZEROED) != 0;

    now->silent_ms = 0;
    now->in_contact = (c->flags & FLAG_IN_CONTACT) != 0;
    now->contact_limit_kpa = fminf(c->contact_limit_pa / PA_PER_KPA, HARD_LIMIT_KPA);
    now->vent_after_ms = within(c->vent_after_ms, VENT_AFTER_MS_LEAST, VENT_AFTER_MS_MOST);
    if (!among(PRESSURISED_STATES, now->state))
        set_zero(&now->reading, c->zero_pa / PA_PER_KPA, zeroed);
    clear_faults(p, c->clear);
    if (c->mode == MODE_VENT) {
        vent(p);
        p->armed = now->state != STATE_TRIPPED;
    } else if (zeroed && SETPOINT_PA_LEAST <= c->setpoint_pa && c->setpoint_pa <= SETPOINT_PA_MOST) {
        p->wanted_kpa = c->setpoint_pa / PA_PER_KPA;
    }
}

static void keep_to_limits(struct pressure *p)
{
    uint8_t n, state = p->now.state;

    for (n = 0; n < LIMIT_COUNT; n++) {
        const struct limit *limit = &LIMITS[n];
        if (!among(limit->states, state))
            continue;
        if (limit->allowed(&p->now)) {
            p->broken[n] = 0;
        } else if (among(limit->states, p->now.state)) {
            p->broken[n] += p->broken[n] < UINT8_MAX;
            if (p->broken[n] >= limit->samples && !is_latched(&p->now, limit->fault))
                trip(p, limit->fault);
        }
    }
}

static void aim(struct pressure *p)
{
    p->now.setpoint_kpa = p->wanted_kpa;
    filling_begin(&p->now.filling, &p->now.reading);
    p->now.top_ups.low_ms = 0;
}

static uint8_t in_vented(struct pressure *p)
{
    if (!(p->armed && p->wanted_kpa > 0 && p->now.reading.zeroed && may_move(&p->now)))
        return NOTHING_HAPPENS;
    aim(p);
    return HAPPENS_HOLD_ASKED;
}

static uint8_t in_filling(struct pressure *p)
{
    struct situation *now = &p->now;

    if (p->wanted_kpa != now->setpoint_kpa)
        aim(p);
    filling_step(&now->filling, &now->reading);
    if (!may_move(now)) {
        filling_lock(&now->filling);
        return NOTHING_HAPPENS;
    }
    return now->state == STATE_INFLATING ? inflate(&now->filling, &now->reading, now->setpoint_kpa)
                                         : settle(&now->filling, &now->reading, now->setpoint_kpa);
}

static uint8_t in_holding(struct pressure *p)
{
    struct situation *now = &p->now;

    if (!(p->armed && may_move(now)) || now->in_contact)
        return NOTHING_HAPPENS;
    if (top_up_due(&now->top_ups))
        mend(&now->top_ups);
    else if (p->wanted_kpa == now->setpoint_kpa)
        return NOTHING_HAPPENS;
    aim(p);
    return HAPPENS_RETARGETED;
}

static uint8_t progress(struct pressure *p)
{
    switch (p->now.state) {
    case STATE_BOOT:
    case STATE_VENTING:
        return p->now.vent.verified ? HAPPENS_EMPTY : NOTHING_HAPPENS;
    case STATE_VENTED:
        return in_vented(p);
    case STATE_INFLATING:
    case STATE_SETTLING:
        return in_filling(p);
    case STATE_HOLDING:
        return in_holding(p);
    default:
        return NOTHING_HAPPENS;
    }
}

static uint8_t valves_of(const struct situation *now)
{
    if (among(FILLING_STATES, now->state))
        return now->filling.valves;
    return now->state == STATE_HOLDING ? LOCKED : SAFE;
}

/* One sample later. */
static void pressure_step(struct pressure *p, uint16_t adc_sum, uint16_t supply_mv)
{
    uint8_t happening;

    observe(&p->now, adc_sum, supply_mv);
    p->armed = p->armed && (host_heard(&p->now) || among(PRESSURISED_STATES, p->now.state));
    keep_to_limits(p);
    happening = progress(p);
    if (happening != NOTHING_HAPPENS)
        happen(p, happening, FAULT_NONE);
    p->now.valves = valves_of(&p->now);
}

#endif
