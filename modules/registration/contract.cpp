// SPDX-License-Identifier: MIT
module;
#include <stop_token>
module cilantro.registration;

namespace cilantro {

std::stop_token requested_stop() {
  std::stop_source stop;
  stop.request_stop();
  return stop.get_token();
}

}  // namespace cilantro
