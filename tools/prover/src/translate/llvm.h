/* LLVM's integer operations in CBMC's C. `bits` is the operands' width. The statement that uses a
   result truncates it to its own width. Using an operation that is missing here is an error. */

/* C converts integers that are narrower than `int` to `int`. A product or a left shift of an `int` may
   overflow. The types w8 to w128 are unsigned and have at least 32 bits, so C does not convert them. */
#define llvm_add(bits, a, b) ((a) + (b))
#define llvm_sub(bits, a, b) ((a) - (b))
#define llvm_mul(bits, a, b) ((w##bits)(a) * (w##bits)(b))
#define llvm_udiv(bits, a, b) ((a) / (b))
#define llvm_urem(bits, a, b) ((a) % (b))
#define llvm_sdiv(bits, a, b) ((s##bits)(a) / (s##bits)(b))
#define llvm_srem(bits, a, b) ((s##bits)(a) % (s##bits)(b))
#define llvm_shl(bits, a, b) ((w##bits)(a) << (b))
#define llvm_lshr(bits, a, b) ((a) >> (b))
#define llvm_ashr(bits, a, b) ((s##bits)(a) >> (b))
#define llvm_and(bits, a, b) ((a) & (b))
#define llvm_or(bits, a, b) ((a) | (b))
#define llvm_xor(bits, a, b) ((a) ^ (b))

#define llvm_icmp_eq(bits, a, b) ((a) == (b))
#define llvm_icmp_ne(bits, a, b) ((a) != (b))
#define llvm_icmp_ult(bits, a, b) ((a) < (b))
#define llvm_icmp_ule(bits, a, b) ((a) <= (b))
#define llvm_icmp_ugt(bits, a, b) ((a) > (b))
#define llvm_icmp_uge(bits, a, b) ((a) >= (b))
#define llvm_icmp_slt(bits, a, b) ((s##bits)(a) < (s##bits)(b))
#define llvm_icmp_sle(bits, a, b) ((s##bits)(a) <= (s##bits)(b))
#define llvm_icmp_sgt(bits, a, b) ((s##bits)(a) > (s##bits)(b))
#define llvm_icmp_sge(bits, a, b) ((s##bits)(a) >= (s##bits)(b))

#define llvm_umin(bits, a, b) ((a) < (b) ? (a) : (b))
#define llvm_umax(bits, a, b) ((a) > (b) ? (a) : (b))
#define llvm_smin(bits, a, b) (llvm_icmp_slt(bits, a, b) ? (a) : (b))
#define llvm_smax(bits, a, b) (llvm_icmp_sgt(bits, a, b) ? (a) : (b))
#define llvm_abs(bits, a, unused) ((s##bits)(a) < 0 ? -(a) : (a))
#define llvm_usub_sat(bits, a, b) ((a) > (b) ? (a) - (b) : 0)
#define llvm_uadd_sat(bits, a, b) ((u##bits)((a) + (b)) < (a) ? (u##bits)-1 : (a) + (b))
#define llvm_expect(bits, a, unused) (a)
#define llvm_fshl(bits, a, b, by) \
  ((by) % bits == 0 ? (a) : (a) << (by) % bits | (b) >> bits - (by) % bits)
#define llvm_fshr(bits, a, b, by) \
  ((by) % bits == 0 ? (b) : (a) << bits - (by) % bits | (b) >> (by) % bits)
#define llvm_bswap(bits, a) __builtin_bswap##bits(a)
#define __builtin_bswap128(a) \
  ((u128)__builtin_bswap64((u64)(a)) << 64 | __builtin_bswap64((u64)((u128)(a) >> 64)))
#define llvm_bitreverse(bits, a) __builtin_bitreverse##bits(a)

/* The number of k from 0 to bits - 1 for which `holds` is true. */
#define count8(bits, holds, a, k) \
  (holds(bits, a, k) + holds(bits, a, k + 1) + holds(bits, a, k + 2) + holds(bits, a, k + 3) + \
   holds(bits, a, k + 4) + holds(bits, a, k + 5) + holds(bits, a, k + 6) + holds(bits, a, k + 7))
#define count16(bits, holds, a, k) (count8(bits, holds, a, k) + count8(bits, holds, a, k + 8))
#define count32(bits, holds, a, k) (count16(bits, holds, a, k) + count16(bits, holds, a, k + 16))
#define count64(bits, holds, a, k) (count32(bits, holds, a, k) + count32(bits, holds, a, k + 32))
#define count128(bits, holds, a, k) (count64(bits, holds, a, k) + count64(bits, holds, a, k + 64))
#define is_one(bits, a, k) ((u32)((a) >> (k)) & 1)
#define all_above_are_zero(bits, a, k) ((u##bits)((a) >> (k)) == 0)
#define all_below_are_zero(bits, a, k) ((u##bits)((a) << (k)) == 0)
#define llvm_ctpop(bits, a) count##bits(bits, is_one, a, 0)
#define llvm_ctlz(bits, a, unused) count##bits(bits, all_above_are_zero, a, 0)
#define llvm_cttz(bits, a, unused) count##bits(bits, all_below_are_zero, a, 0)

/* The truncated result, and whether it overflows. Operands have at most 64 bits. */
#define exact(sign, bits, a, operator, b) \
  ((sign##128)(sign##bits)(a) operator (sign##128)(sign##bits)(b))
#define with_overflow(sign, bits, a, operator, b) \
  { (u##bits)exact(sign, bits, a, operator, b), \
    (u1)(exact(sign, bits, a, operator, b) != \
         (sign##128)(sign##bits)exact(sign, bits, a, operator, b)) }
#define llvm_uadd_with_overflow(bits, a, b) with_overflow(u, bits, a, +, b)
#define llvm_usub_with_overflow(bits, a, b) with_overflow(u, bits, a, -, b)
#define llvm_umul_with_overflow(bits, a, b) with_overflow(u, bits, a, *, b)
#define llvm_sadd_with_overflow(bits, a, b) with_overflow(s, bits, a, +, b)
#define llvm_ssub_with_overflow(bits, a, b) with_overflow(s, bits, a, -, b)
#define llvm_smul_with_overflow(bits, a, b) with_overflow(s, bits, a, *, b)
