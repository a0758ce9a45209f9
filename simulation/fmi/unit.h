/* A co-simulation unit: what FMI 2 (fmi2.c) and FMI 3 (fmi3.c) share, and what a model gives.
 *
 * model.h, written for each unit, holds TOKEN, START_VALUES of the inputs, the sizes N_U (inputs), N_X (states),
 * N_Y (outputs) and N_MEMORY (numbers that the model's step remembers beside its states); model_data.h the
 * constants of the model's file. */
#ifndef UNIT_H
#define UNIT_H
#include <stddef.h>
#include "model.h"

/* What an importing tool finds in the library. */
#if defined(_WIN32)
#define API __declspec(dllexport)
#else
#define API __attribute__((visibility("default")))
#endif

/* Value references: the time, then each group behind the one before. */
enum {
    TIME = 0,
    INPUTS = 1,
    RATES = INPUTS + N_U,
    OUTPUTS = RATES + N_U,
    STATES = OUTPUTS + N_Y,
    DERIVATIVES = STATES + N_X,
    N_VARIABLES = DERIVATIVES + N_X
};

enum { OK = 0, FAILED = 3 };
enum { INSTANTIATED = 1, INITIALISING, STEPPING, TERMINATED };

/* All that decides how a unit goes on: copied whole to get, set and store it. */
typedef struct {
    double time, u[N_U], rate[N_U], x[N_X], memory[N_MEMORY];
    int mode, at_rest; /* at_rest: x belongs to the inputs u; an input set before the start clears it */
} State;

typedef struct Work Work; /* What a model computes anew from a State, such as matrices of a step. */

typedef struct Unit {
    State state;
    Work *work;
    void (*report)(const struct Unit *, const char *message);
    void *environment; /* Of the importing tool, for its messages. */
    void (*logger)(void);
    char *name;
} Unit;

/* Of the model. A message is NULL where all went well. */
Work *model_work(void);
void model_free(Work *);
const char *model_start(Work *, State *);
const char *model_step(Work *, State *, double size);
void model_outputs(Work *, const State *, double y[]);
void model_derivatives(Work *, const State *, double dx[]);
/* Changes dx' and dy with changes du and dx; before the first step dx and dy of the rest with du. */
const char *model_changes(Work *, const State *, const double du[], double dx[], double rate[], double dy[]);

/* Of the interface; each returns OK or reports and returns FAILED. */
Unit *unit_made(const char *name, const char *token);
void unit_freed(Unit *);
int unit_failed(const Unit *, const char *message);
int unit_started_at(Unit *, double time);
int unit_initialising(Unit *);
int unit_initialised(Unit *);
int unit_terminated(Unit *);
int unit_reset(Unit *);
int unit_get(Unit *, const unsigned references[], size_t n, double values[]);
int unit_set(Unit *, const unsigned references[], size_t n, const double values[]);
int unit_step(Unit *, double time, double size);
int unit_output_derivatives(Unit *, const unsigned references[], size_t n, const int orders[], double values[]);
int unit_directional(Unit *, const unsigned unknowns[], size_t n_unknowns, const unsigned knowns[], size_t n_knowns,
                     const double seed[], double sensitivity[]);
int unit_adjoint(Unit *, const unsigned unknowns[], size_t n_unknowns, const unsigned knowns[], size_t n_knowns,
                 const double seed[], double sensitivity[]);
int unit_get_state(Unit *, void **state);
int unit_set_state(Unit *, const void *state);
int unit_free_state(Unit *, void **state);
int unit_stored_size(Unit *, const void *state, size_t *size);
int unit_stored(Unit *, const void *state, char bytes[], size_t size);
int unit_restored(Unit *, const char bytes[], size_t size, void **state);

/* Solve a x = b with row exchange; b holds `columns` right-hand sides. 0 where a is singular. */
int solved(int n, double *a, double *b, int columns);
#endif
