// SPDX-License-Identifier: MIT
module;
#include <ostream>
module cilantro.registration;

namespace cilantro {

std::string_view to_string(icp_status status) {
  switch (status) {
    case icp_status::converged:
      return "converged";
    case icp_status::iteration_limit:
      return "iteration_limit";
    case icp_status::too_few_pairs:
      return "too_few_pairs";
    case icp_status::degenerate:
      return "degenerate";
    case icp_status::cancelled:
      return "cancelled";
  }
  return "?";
}

std::ostream& operator<<(std::ostream& out, icp_status status) {
  return out << to_string(status);
}

void print_figures(std::ostream& out, icp_status status, int iterations, const alignment_fit& fit) {
  out << status << " after " << iterations << (iterations == 1 ? " iteration: " : " iterations: ")
      << fit.pairs << " pairs, overlap " << fit.overlap << ", rmse " << fit.rmse << ", residual "
      << fit.residual;
  if (fit.undetermined > 0)
    out << ", " << fit.undetermined << " of " << fit.unknowns << " directions undetermined";
  if (fit.non_finite > 0) out << ", " << fit.non_finite << " points not finite";
}

}  // namespace cilantro
