// SPDX-License-Identifier: MIT
module cilantro.registration;

namespace cilantro {

std::stop_token requested_stop() {
  std::stop_source stop;
  stop.request_stop();
  return stop.get_token();
}

}  // namespace cilantro
