typedef __CPROVER_size_t size_t;
#define NULL ((void *)0)
