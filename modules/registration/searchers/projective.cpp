// SPDX-License-Identifier: MIT
module cilantro.registration;

namespace cilantro {

template <Scalar S>
void projective_searcher<S>::pair_moved(points_view<S, 3> source, correspondences<S>& out) const {
  const auto to_camera = camera_.to_world.inverse();
  out.resize(source.size());
  parallel_for(source.size(), {.threads = options_.threads}, [&](index_t s) {
    auto& pair = out[s];
    pair = {static_cast<std::int32_t>(s), -1, 0};
    const point_vector<S, 3> ahead = to_camera * source[s];
    if (!(ahead.z() > 0)) return;
    const S u = std::round(camera_.fx * ahead.x() / ahead.z() + camera_.cx);
    const S v = std::round(camera_.fy * ahead.y() / ahead.z() + camera_.cy);
    if (!(u >= 0 && u < S(camera_.width) && v >= 0 && v < S(camera_.height))) return;
    pair.target = seen_(static_cast<int>(u), static_cast<int>(v));
    if (pair.target >= 0) pair.distance = (source[s] - target_[pair.target]).norm();
  });
  std::erase_if(out, [](const auto& pair) { return pair.target < 0; });
  select_correspondences(out, options_);
}

template class projective_searcher<float>;
template class projective_searcher<double>;

}  // namespace cilantro
