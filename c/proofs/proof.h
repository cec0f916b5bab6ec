/* Macros that all harnesses in C use. Before including this file, define NAME and UPPER, the
 * prefixes of the names in a header. */
#define JOIN_(one, other) one##_##other
#define JOIN(one, other) JOIN_(one, other)
#define X(name) JOIN(NAME, name)
#define XX(name) JOIN(UPPER, name)
/* Stands for a reason that a header does not have. */
#define NONE XX(REASONS)

/* Defines a harness. Each loop performs fewer than `bound` iterations. */
#define PROOF_(name, bound) void proof_##name##_##bound(void)
#define PROOF(name, bound) PROOF_(name, bound)

#define ASSUME(condition) __CPROVER_assume(condition)
#define ASSERT(condition) __CPROVER_assert((condition), #condition)
/* The proof fails if no input satisfies this condition. */
#define COVER(condition) __CPROVER_assert(!(condition), "cover: " #condition)

/* Each of these functions returns an arbitrary value. */
_Bool nondet_bool(void);
uint8_t nondet_uint8(void);
uint16_t nondet_uint16(void);
uint32_t nondet_uint32(void);
