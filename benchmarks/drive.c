// Copyright 2026 The stickslip_ros maintainers
// SPDX-License-Identifier: Apache-2.0

/*
The ideal drive in plain C: the algorithm of drive/advance.py, drive/long_step.py,
contact/memory.py and contact/virgin.py, with the same arithmetic in the same order. What the
standard case never comes to is left out: walls, tables and missed ramps, a full stack of turning
points (which ends the run), the count of passes.
*/

#include <math.h>

enum { CAPACITY = 1024, SLEW_REFINEMENT = 64 };

static const double SETTLED_V = 1e-9, CORNER_S = 1e-15, RESTING = 1e-3, SLOPE_STEPS_MIN = 6.0;
static const double SIXTH = 1.0 / 6.0;

typedef struct { double force_n, stiffness_n_per_m, half_slope, energy_j; } Cell;

typedef struct {
    double mass_kg, per_kg, damping_n_s_per_m, cell_n_per_m, gain_m_per_v, rest_v;
    double voltage_min_v, voltage_max_v, slew_v_per_s, dt_s;
    double cells_per_m, core_m, limit_m, force_max_n, energy_max_j;
    const Cell *cells;
    long cell_count;
} Plant;

typedef struct { double start_v, rise_v, period_s; long cycles; } Wave;

typedef struct { double u_m, force_n; } Turn;

typedef struct {
    double u_m, force_n, sense, lost_j, base_j;
    long depth;
    Turn stack[CAPACITY];
} Memory;

typedef struct {
    double ramp_s, start_m, start_m_s;
    long cycle;
    double voltage_v, foot_m, position_m, velocity_m_per_s;
    double feet_work_j, load_work_j, damping_lost_j, position_m_s;
    Memory memory;
} State;

typedef struct { double start_m, mean_m, end_m; } Ramp;

typedef struct { double origin_m, force_n, sense, fold, unfold, reach_m; } Branch;

typedef struct { double speed, speeding, pull, pull_rate, gamma; } Slide;

typedef struct { double velocity, impulse, step, ramp; } Propagator;

static inline double least(double a, double b) { return b < a ? b : a; }
static inline double most(double a, double b) { return b > a ? b : a; }

static inline double clamp(const Plant *plant, double voltage_v)
{
    return least(most(voltage_v, plant->voltage_min_v), plant->voltage_max_v);
}

/* --- the virgin curve ------------------------------------------------------------------------ */

static inline double virgin_force(const Plant *plant, double displacement_m)
{
    double place = displacement_m * plant->cells_per_m;
    if (!(place < plant->cell_count))
        return plant->force_max_n;
    const Cell *cell = &plant->cells[(long)place];
    double rest_m = displacement_m - (long)place * plant->core_m;
    return cell->force_n + rest_m * (cell->stiffness_n_per_m + rest_m * cell->half_slope);
}

static inline double virgin_stiffness(const Plant *plant, double displacement_m)
{
    double place = displacement_m * plant->cells_per_m;
    if (!(place < plant->cell_count))
        return 0.0;
    const Cell *cell = &plant->cells[(long)place];
    double rest_m = displacement_m - (long)place * plant->core_m;
    return cell->stiffness_n_per_m + 2.0 * rest_m * cell->half_slope;
}

static inline double virgin_energy(const Plant *plant, double displacement_m)
{
    double place = displacement_m * plant->cells_per_m;
    if (!(place < plant->cell_count))
        return plant->energy_max_j + plant->force_max_n * (displacement_m - plant->limit_m);
    const Cell *cell = &plant->cells[(long)place];
    double rest_m = displacement_m - (long)place * plant->core_m;
    return cell->energy_j
           + rest_m * (cell->force_n
                       + rest_m * (cell->stiffness_n_per_m / 2.0
                                   + rest_m * cell->half_slope / 3.0));
}

/* --- the memory of turning points ------------------------------------------------------------ */

static inline double loop_length(const Memory *memory, long depth)
{
    double length_m = fabs(memory->stack[depth].u_m - memory->stack[depth - 1].u_m);
    return depth == 1 ? 2.0 * length_m : length_m;
}

static inline double branch_loss(const Plant *plant, long depth, double travel_m)
{
    if (depth == 0) {
        double force_n = virgin_force(plant, travel_m);
        return 2.0 * virgin_energy(plant, travel_m) - travel_m * force_n;
    }
    double half_m = 0.5 * travel_m;
    double force_n = virgin_force(plant, half_m);
    return 4.0 * virgin_energy(plant, half_m) - 2.0 * half_m * force_n;
}

static inline double resumed_loss(const Plant *plant, const Memory *memory, long depth)
{
    double travel_m = fabs(memory->stack[depth + 1].u_m - memory->stack[depth].u_m);
    return branch_loss(plant, depth, travel_m);
}

/* Turn round; return 0 if the stack is full. */
static inline int reverse(const Plant *plant, Memory *memory, double u_m)
{
    long depth = memory->depth;
    double travel_m = fabs(memory->u_m - memory->stack[depth].u_m);
    double core_m = depth == 0 ? plant->core_m : 2.0 * plant->core_m;
    if (travel_m > core_m) {
        if (depth + 1 == CAPACITY)
            return 0;
        memory->lost_j = memory->lost_j + branch_loss(plant, depth, travel_m) - memory->base_j;
        memory->base_j = 0.0;
        memory->depth = depth + 1;
        memory->stack[depth + 1] = (Turn){memory->u_m, memory->force_n};
        memory->sense = -memory->sense;
    } else if (depth > 0 && memory->sense * (u_m - memory->stack[depth].u_m) < 0.0) {
        memory->lost_j = memory->lost_j - memory->base_j;
        memory->base_j = resumed_loss(plant, memory, depth - 1);
        memory->depth = depth - 1;
        memory->sense = -memory->sense;
    }
    return 1;
}

static inline void close_loop(const Plant *plant, Memory *memory)
{
    long depth = memory->depth;
    double length_m = loop_length(memory, depth);
    memory->lost_j = memory->lost_j + branch_loss(plant, depth, length_m) - memory->base_j;
    memory->depth = depth > 2 ? depth - 2 : 0;
    memory->base_j = resumed_loss(plant, memory, memory->depth);
}

static inline void follow_virgin(const Plant *plant, Memory *memory, double u_m)
{
    double offset_m = u_m - memory->stack[0].u_m;
    double slip_m = most(fabs(offset_m) - plant->limit_m, 0.0);
    memory->sense = offset_m >= 0.0 ? 1.0 : -1.0;
    memory->stack[0].u_m += memory->sense * slip_m;
    memory->lost_j = memory->lost_j + slip_m * plant->force_max_n;
}

static inline double branch_force(const Plant *plant, const Memory *memory, double u_m)
{
    double travel_m = memory->sense * (u_m - memory->stack[memory->depth].u_m);
    if (memory->depth == 0)
        return memory->sense * virgin_force(plant, travel_m);
    double half_n = virgin_force(plant, 0.5 * travel_m);
    return memory->stack[memory->depth].force_n + memory->sense * 2.0 * half_n;
}

/* Move to u_m in one direction; return 0 if the stack is full. */
static inline int move(const Plant *plant, Memory *memory, double u_m)
{
    if ((u_m - memory->u_m) * memory->sense < 0.0 && !reverse(plant, memory, u_m))
        return 0;
    while (memory->depth > 0
           && memory->sense * (u_m - memory->stack[memory->depth].u_m)
                  >= loop_length(memory, memory->depth))
        close_loop(plant, memory);
    if (memory->depth == 0)
        follow_virgin(plant, memory, u_m);
    memory->force_n = branch_force(plant, memory, u_m);
    memory->u_m = u_m;
    return 1;
}

/* --- the branch ahead ------------------------------------------------------------------------ */

static inline Branch branch_towards(const Plant *plant, const Memory *memory, double direction)
{
    long depth = memory->depth;
    const Turn *turn = &memory->stack[depth];
    double fold = depth == 0 ? 1.0 : 2.0, travel_m = fabs(memory->u_m - turn->u_m);
    if (direction * memory->sense >= 0.0 || travel_m <= fold * plant->core_m) {
        if (depth == 0)
            return (Branch){turn->u_m, 0.0, memory->sense, 1.0, 1.0, INFINITY};
        return (Branch){turn->u_m, turn->force_n, memory->sense, 2.0, 0.5,
                        loop_length(memory, depth)};
    }
    return (Branch){memory->u_m, memory->force_n, -memory->sense, 2.0, 0.5,
                    depth == 0 ? 2.0 * travel_m : travel_m};
}

static double force_after_closing(const Plant *plant, const Memory *memory, double u_m)
{
    double direction = u_m > memory->u_m ? 1.0 : -1.0;
    long depth = memory->depth;
    if (direction != memory->sense)
        depth = depth > 1 ? depth - 1 : 0;
    while (depth > 0
           && direction * (u_m - memory->stack[depth].u_m) >= loop_length(memory, depth))
        depth = depth > 2 ? depth - 2 : 0;
    double offset_m = u_m - memory->stack[depth].u_m;
    if (depth == 0)
        return copysign(virgin_force(plant, fabs(offset_m)), offset_m);
    return memory->stack[depth].force_n
           + direction * 2.0 * virgin_force(plant, 0.5 * fabs(offset_m));
}

static inline double force_ahead(const Plant *plant, const Memory *memory, const Branch *branch,
                                 double u_m)
{
    double travel_m = branch->sense * (u_m - branch->origin_m);
    if (0.0 <= travel_m && travel_m < branch->reach_m) {
        double folded_n = branch->fold * virgin_force(plant, travel_m * branch->unfold);
        return branch->force_n + branch->sense * folded_n;
    }
    return force_after_closing(plant, memory, u_m);
}

/* --- one long step --------------------------------------------------------------------------- */

static inline Propagator propagator(double omega_squared, double gamma, double h_s)
{
    double z = omega_squared * h_s * h_s, y = gamma * h_s;
    double b3 = 1.0 / 6.0;
    double b4 = -y * b3 * (1.0 / 4.0);
    double b5 = -(4.0 * y * b4 + z * b3) * (1.0 / 20.0);
    double b6 = -(5.0 * y * b5 + z * b4) * (1.0 / 30.0);
    double b7 = -(6.0 * y * b6 + z * b5) * (1.0 / 42.0);
    double b8 = -(7.0 * y * b7 + z * b6) * (1.0 / 56.0);
    double b9 = -(8.0 * y * b8 + z * b7) * (1.0 / 72.0);
    double b10 = -(9.0 * y * b9 + z * b8) * (1.0 / 90.0);
    double b11 = -(10.0 * y * b10 + z * b9) * (1.0 / 110.0);
    double even = 4.0 * b4 + 6.0 * b6 + 8.0 * b8 + 10.0 * b10;
    double odd = 3.0 * b3 + 5.0 * b5 + 7.0 * b7 + 9.0 * b9 + 11.0 * b11;
    double ramp = (b3 + b4 + b5 + b6 + b7 + b8 + b9 + b10 + b11) * h_s * h_s * h_s;
    double step = (even + odd) * h_s * h_s;
    double impulse = h_s - gamma * step - omega_squared * ramp;
    return (Propagator){1.0 - gamma * impulse - omega_squared * step, impulse, step, ramp};
}

static inline double time_to_turn(const Slide *slide, double omega_squared, double longest_s)
{
    double speed = slide->speed, speeding = slide->speeding, gamma = slide->gamma;
    double jerk = slide->pull_rate - omega_squared * speed - gamma * speeding;
    double snap = -omega_squared * speeding - gamma * jerk;
    double crackle = -omega_squared * jerk - gamma * snap;
    double t = -speed / speeding;
    if (t > 2.0 * longest_s)
        return longest_s;
    double value = speed
                   + t * (speeding
                          + t * (0.5 * jerk + t * (SIXTH * snap + t * 0.25 * SIXTH * crackle)));
    double slope = speeding + t * (jerk + t * (0.5 * snap + t * SIXTH * crackle));
    t -= value / slope;
    return 0.0 < t && t < longest_s ? most(t, RESTING * longest_s) : longest_s;
}

static inline double time_to_close(const Slide *slide, const Branch *branch, double u_m,
                                   double longest_s)
{
    double gap_m = branch->reach_m - branch->sense * (u_m - branch->origin_m);
    double speed = branch->sense * slide->speed, speeding = branch->sense * slide->speeding;
    if (gap_m >= longest_s * (speed + 0.5 * longest_s * speeding) || speed <= 0.0)
        return longest_s;
    double t = gap_m / speed;
    return RESTING * longest_s < t && t < longest_s ? t : longest_s;
}

/* Advance until the sliding turns, at most by a given time; return the time, 0 if it failed. */
static inline double long_step(const Plant *plant, State *state, double rate_v_per_s, double load_n,
                           double longest_s)
{
    Memory *memory = &state->memory;
    double foot_m_per_s = plant->gain_m_per_v * rate_v_per_s;
    double before_n = memory->force_n, before_u_m = memory->u_m;
    double v_0 = state->velocity_m_per_s, before_m = state->position_m;

    Slide slide;
    slide.gamma = plant->damping_n_s_per_m * plant->per_kg;
    double drag_n = plant->damping_n_s_per_m * foot_m_per_s;
    double others_n = load_n - before_n - plant->cell_n_per_m * before_m;
    slide.pull = (others_n - drag_n) * plant->per_kg;
    slide.pull_rate = -plant->cell_n_per_m * foot_m_per_s * plant->per_kg;
    slide.speed = v_0 - foot_m_per_s;
    slide.speeding = slide.pull - slide.gamma * slide.speed;

    int rests = fabs(slide.speed) < RESTING * fabs(slide.speeding) * longest_s;
    Branch branch = branch_towards(plant, memory, rests ? slide.speeding : slide.speed);
    double tangent = virgin_stiffness(plant, fabs(before_u_m - branch.origin_m) * branch.unfold);
    double omega_squared = (plant->cell_n_per_m + tangent) * plant->per_kg;
    int turns = !rests && slide.speed * slide.speeding < 0.0;
    double h_s = turns ? time_to_turn(&slide, omega_squared, longest_s) : longest_s;
    h_s = time_to_close(&slide, &branch, before_u_m, h_s);

    Propagator half = propagator(omega_squared, slide.gamma, 0.5 * h_s);
    double y_middle = slide.speed * half.impulse + slide.pull * half.step
                      + slide.pull_rate * half.ramp;
    double w_middle = slide.speed * half.velocity + slide.pull * half.impulse
                      + slide.pull_rate * half.step;
    double pull_middle = slide.pull + slide.pull_rate * 0.5 * h_s - omega_squared * y_middle;
    double y_end = y_middle + w_middle * half.impulse + pull_middle * half.step
                   + slide.pull_rate * half.ramp;
    double w_end = w_middle * half.velocity + pull_middle * half.impulse
                   + slide.pull_rate * half.step;

    double middle_n = force_ahead(plant, memory, &branch, before_u_m + y_middle);
    double missed_middle = (middle_n - before_n - tangent * y_middle) * plant->per_kg;
    y_end -= 4.0 * SIXTH * h_s * half.impulse * missed_middle;

    state->voltage_v = state->voltage_v + rate_v_per_s * h_s;
    double foot_m = plant->gain_m_per_v * (state->voltage_v - plant->rest_v);
    double position_m = foot_m + before_u_m + y_end;
    if (!move(plant, memory, position_m - foot_m))
        return 0.0;

    double missed_end = (memory->force_n - before_n - tangent * y_end) * plant->per_kg;
    w_end -= (SIXTH * h_s) * (4.0 * half.velocity * missed_middle + missed_end);
    w_middle -= (SIXTH * h_s) * missed_middle;

    double v_half = foot_m_per_s + w_middle, v_1 = foot_m_per_s + w_end;
    double middle_m = before_m + 0.5 * h_s * foot_m_per_s + y_middle;
    double mean_contact_n = (before_n + 4.0 * middle_n + memory->force_n) * SIXTH;
    double mean_square = (v_0 * v_0 + 4.0 * v_half * v_half + v_1 * v_1) * SIXTH;
    double mean_m = (before_m + 4.0 * middle_m + position_m) * SIXTH;
    state->feet_work_j -= mean_contact_n * (foot_m - state->foot_m);
    state->load_work_j += load_n * (position_m - before_m);
    state->damping_lost_j += plant->damping_n_s_per_m * mean_square * h_s;
    state->position_m_s += mean_m * h_s;

    state->foot_m = foot_m;
    state->position_m = position_m;
    state->velocity_m_per_s = v_1;
    return h_s;
}

/* --- from corner to corner ------------------------------------------------------------------- */

static inline double longest_on_slope(const Plant *plant, double rate_v_per_s)
{
    int falls = fabs(rate_v_per_s) >= plant->slew_v_per_s;
    double longest_s = falls ? plant->dt_s / SLEW_REFINEMENT : plant->dt_s;
    double foot_m_per_s = plant->gain_m_per_v * fabs(rate_v_per_s);
    double travel_m = plant->limit_m / SLOPE_STEPS_MIN;
    return foot_m_per_s * longest_s <= travel_m ? longest_s : travel_m / foot_m_per_s;
}

static inline int take_long_steps(const Plant *plant, State *state, double start_v, double rate_v_per_s,
                       double load_n, double stretch_s)
{
    double longest_s = longest_on_slope(plant, rate_v_per_s), left_s = stretch_s;
    state->voltage_v = start_v;
    while (left_s > 0.0) {
        double h_s = left_s;
        if (left_s > longest_s)
            h_s = left_s >= 2.0 * longest_s ? longest_s : 0.5 * left_s;
        double done_s = long_step(plant, state, rate_v_per_s, load_n, h_s);
        if (done_s == 0.0)
            return 0;
        left_s = done_s < left_s ? left_s - done_s : 0.0;
    }
    state->voltage_v = clamp(plant, start_v + rate_v_per_s * stretch_s);
    return 1;
}

static inline void advance_clock(const Wave *wave, State *state, double stretch_s, int fall_is_over,
                             Ramp *ramps, long rows)
{
    state->ramp_s = state->ramp_s + stretch_s;
    if (fall_is_over)
        state->start_m = state->position_m;
    if (state->cycle < wave->cycles && wave->period_s - state->ramp_s <= CORNER_S) {
        double mean_m = (state->position_m_s - state->start_m_s) / wave->period_s;
        ramps[state->cycle % rows] = (Ramp){state->start_m, mean_m, state->position_m};
        state->ramp_s -= wave->period_s;
        state->cycle += 1;
        state->start_m = state->position_m;
        state->start_m_s = state->position_m_s;
    }
}

/* Advance the drive by a duration; return 0 if its stack of turning points was full. */
int advance(const Plant *plant, State *state, const Wave *wave, double load_n, double duration_s,
            Ramp *ramps, long rows)
{
    double remaining_s = duration_s, slew = plant->slew_v_per_s;
    while (remaining_s > 0.0) {
        double target_v = wave->start_v, slope_v_per_s = 0.0, corner_s = INFINITY;
        if (state->cycle < wave->cycles) {
            slope_v_per_s = wave->rise_v / wave->period_s;
            target_v = wave->start_v + slope_v_per_s * state->ramp_s;
            corner_s = wave->period_s - state->ramp_s;
        }
        double wanted_v = clamp(plant, target_v), gap_v = wanted_v - state->voltage_v;
        double start_v = state->voltage_v, rate_v_per_s = copysign(slew, gap_v);
        double closing_v_per_s = rate_v_per_s - slope_v_per_s;
        double caught_s = closing_v_per_s * gap_v > 0.0 ? gap_v / closing_v_per_s : INFINITY;
        if (fabs(gap_v) <= SETTLED_V || state->ramp_s + caught_s <= state->ramp_s) {
            start_v = wanted_v;
            rate_v_per_s = least(most(slope_v_per_s, -slew), slew);
            caught_s = INFINITY;
        }
        double stretch_s = least(least(remaining_s, corner_s), caught_s);
        if (!take_long_steps(plant, state, start_v, rate_v_per_s, load_n, stretch_s))
            return 0;
        double left_v = clamp(plant, target_v + slope_v_per_s * stretch_s) - state->voltage_v;
        int fall_is_over = caught_s < INFINITY && fabs(left_v) <= SETTLED_V;
        advance_clock(wave, state, stretch_s, fall_is_over, ramps, rows);
        remaining_s -= stretch_s;
    }
    return 1;
}
