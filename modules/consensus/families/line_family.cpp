// SPDX-License-Identifier: MIT
module cilantro.consensus;

namespace cilantro {

std::optional<line_model<dynamic>> fit_line(const std::optional<principal_frame>& frame,
                                            const line_limits& limits) {
  if (!frame) return std::nullopt;
  const index_t last = frame->variances.size() - 1;
  // All points equal: there is no direction.
  if (last < 0 || !(frame->variances[last] > 0)) return std::nullopt;
  Eigen::VectorXd direction = frame->axes.col(last);
  if (!allows(limits.direction, direction)) return std::nullopt;
  index_t largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  if (direction[largest] < 0) direction = -direction;
  return line_model<dynamic>{frame->mean, direction};
}

}  // namespace cilantro
