// SPDX-License-Identifier: MIT
export module cilantro.core:vector_target;

import cilantro.standard;

namespace cilantro {

/// The vector instructions that the library's inner loops are compiled for. Results do not depend
/// on them, to the last bit.
export enum class vector_target {
  baseline,  ///< What every machine of the architecture has: SSE2, or NEON.
  avx2,
  avx512  ///< F, BW, DQ and VL.
};

/// "baseline", "avx2" or "avx512".
export [[nodiscard]] std::string_view name_of(vector_target target);

/// Whether this machine has it, and the library was built for its architecture.
export [[nodiscard]] bool is_available(vector_target target);

/// The one in use: the widest that is available and not wider than what the environment variable
/// `CILANTRO_VECTOR_TARGET`, if there is one, names.
export [[nodiscard]] vector_target current_vector_target();

/// From now on, uses `target`, for measuring and testing. Not while other calls are running.
/// Throws `invalid_input` if it is not available.
export void use_vector_target(vector_target target);

}  // namespace cilantro
