// SPDX-License-Identifier: MIT
export module cilantro.core:vector_target;

import cilantro.standard;

namespace cilantro {

/// The vector instructions that the library's inner loops use. Results are the same with all of
/// them, to the last bit.
export enum class vector_target {
  baseline,  ///< Those of every machine of the architecture: SSE2 or NEON.
  avx2,      ///< AVX2.
  avx512     ///< AVX-512 F, BW, DQ and VL.
};

/// The name of a target: "baseline", "avx2" or "avx512".
export [[nodiscard]] std::string_view name_of(vector_target target);

/// Whether this machine has these instructions, and the library was built for its architecture.
export [[nodiscard]] bool is_available(vector_target target);

/// The target in use: the widest that is available, and no wider than the one named by the
/// environment variable `CILANTRO_VECTOR_TARGET`, if it is set.
export [[nodiscard]] vector_target current_vector_target();

/// Uses `target` from now on, for measuring and testing. Must not be called while other calls into
/// the library are running. Throws `invalid_input` if the target is not available.
export void use_vector_target(vector_target target);

}  // namespace cilantro
