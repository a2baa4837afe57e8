// SPDX-License-Identifier: MIT
//
// Eigen as a module. Eigen's headers are read here and nowhere else, so that every other unit, and
// every user, imports a compiled Eigen instead of parsing it. What is missing here can be added;
// names with internal linkage (Eigen::Dynamic, Eigen::all, Eigen::last) cannot be exported, which
// is why cilantro::dynamic exists.
module;
#if defined(__aarch64__)
// The same bits as on x86-64 without -march, which has no fused operations: Eigen is to use none,
// and CMake tells the compiler to make none. docs/determinism.md says how far that carries.
#include <arm_neon.h>
#undef __ARM_FEATURE_FMA
#undef vfmaq_laneq_f32
#undef vfmaq_laneq_f64
#define vfmaq_n_f32(c, a, b) vaddq_f32(c, vmulq_n_f32(a, b))
#define vfmaq_n_f64(c, a, b) vaddq_f64(c, vmulq_n_f64(a, b))
#define vfmaq_laneq_f32(c, a, b, lane) vaddq_f32(c, vmulq_laneq_f32(a, b, lane))
#define vfmaq_laneq_f64(c, a, b, lane) vaddq_f64(c, vmulq_laneq_f64(a, b, lane))
#endif
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/OrderingMethods>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <Eigen/SparseCore>
export module cilantro.eigen;

// How fixed-size Eigen types are laid out depends on the first number, and how the memory of
// dynamic ones is freed on the second; both follow from -march. CMake's target carries those that
// the library was compiled with. Why a mismatch is refused: docs/decisions/0003-eigen-memory.md
static_assert(
    EIGEN_MAX_ALIGN_BYTES == 16,
    "cilantro and everything that imports it must be compiled with EIGEN_MAX_ALIGN_BYTES=16; "
    "linking the CMake target cilantro::cilantro sets it");
static_assert(
    EIGEN_MALLOC_ALREADY_ALIGNED == CILANTRO_EIGEN_MALLOC_ALREADY_ALIGNED,
    "Eigen allocates in another way here than in the compiled cilantro, because only one of them "
    "is "
    "compiled for AVX (-march=native) or with the address sanitizer: build cilantro with the same "
    "flags");

export namespace Eigen {

using Eigen::AlignedBox;
using Eigen::AMDOrdering;
using Eigen::AngleAxis;
using Eigen::Array;
using Eigen::ArrayBase;
using Eigen::BDCSVD;
using Eigen::Block;
using Eigen::ColPivHouseholderQR;
using Eigen::CompleteOrthogonalDecomposition;
using Eigen::CwiseBinaryOp;
using Eigen::CwiseNullaryOp;
using Eigen::CwiseUnaryOp;
using Eigen::DenseBase;
using Eigen::Diagonal;
using Eigen::DiagonalMatrix;
using Eigen::EigenBase;
using Eigen::EigenSolver;
using Eigen::FullPivHouseholderQR;
using Eigen::FullPivLU;
using Eigen::GeneralizedSelfAdjointEigenSolver;
using Eigen::HouseholderQR;
using Eigen::Hyperplane;
using Eigen::Index;
using Eigen::InnerStride;
using Eigen::IOFormat;
using Eigen::JacobiSVD;
using Eigen::LDLT;
using Eigen::LLT;
using Eigen::Map;
using Eigen::Matrix;
using Eigen::MatrixBase;
using Eigen::NumTraits;
using Eigen::OuterStride;
using Eigen::ParametrizedLine;
using Eigen::PartialPivLU;
using Eigen::PermutationMatrix;
using Eigen::PlainObjectBase;
using Eigen::Product;
using Eigen::Quaternion;
using Eigen::QuaternionBase;
using Eigen::Ref;
using Eigen::Rotation2D;
using Eigen::RotationBase;
using Eigen::SelfAdjointEigenSolver;
using Eigen::SparseMatrix;
using Eigen::SparseMatrixBase;
using Eigen::Stride;
using Eigen::Transform;
using Eigen::Translation;
using Eigen::Transpose;
using Eigen::Triplet;
using Eigen::umeyama;
using Eigen::VectorBlock;

using Eigen::Scaling;
using Eigen::seq;
using Eigen::seqN;
using Eigen::UniformScaling;

using Eigen::Affine;
using Eigen::AffineCompact;
using Eigen::Aligned;
using Eigen::AutoAlign;
using Eigen::ColMajor;
using Eigen::ComputeEigenvectors;
using Eigen::ComputeFullU;
using Eigen::ComputeFullV;
using Eigen::ComputeThinU;
using Eigen::ComputeThinV;
using Eigen::DontAlign;
using Eigen::EigenvaluesOnly;
using Eigen::InvalidInput;
using Eigen::Isometry;
using Eigen::Lower;
using Eigen::NoConvergence;
using Eigen::NumericalIssue;
using Eigen::Projective;
using Eigen::RowMajor;
using Eigen::Success;
using Eigen::Unaligned;
using Eigen::Upper;

using Eigen::operator<<;
using Eigen::operator*;
using Eigen::abs;
using Eigen::cos;
using Eigen::exp;
using Eigen::log;
using Eigen::pow;
using Eigen::sin;
using Eigen::sqrt;
using Eigen::tan;

using Eigen::Matrix2;
using Eigen::Matrix3;
using Eigen::Matrix4;
using Eigen::MatrixX;
using Eigen::RowVector;
using Eigen::RowVectorX;
using Eigen::Vector;
using Eigen::Vector2;
using Eigen::Vector3;
using Eigen::Vector4;
using Eigen::VectorX;

using Eigen::Affine2d;
using Eigen::Affine2f;
using Eigen::Affine3d;
using Eigen::Affine3f;
using Eigen::AlignedBox2d;
using Eigen::AlignedBox2f;
using Eigen::AlignedBox3d;
using Eigen::AlignedBox3f;
using Eigen::AlignedBox4d;
using Eigen::AlignedBox4f;
using Eigen::AlignedBoxXd;
using Eigen::AlignedBoxXf;
using Eigen::AngleAxisd;
using Eigen::AngleAxisf;
using Eigen::Array22d;
using Eigen::Array22f;
using Eigen::Array22i;
using Eigen::Array2d;
using Eigen::Array2f;
using Eigen::Array2i;
using Eigen::Array33d;
using Eigen::Array33f;
using Eigen::Array33i;
using Eigen::Array3d;
using Eigen::Array3f;
using Eigen::Array3i;
using Eigen::Array44d;
using Eigen::Array44f;
using Eigen::Array44i;
using Eigen::Array4d;
using Eigen::Array4f;
using Eigen::Array4i;
using Eigen::ArrayXd;
using Eigen::ArrayXf;
using Eigen::ArrayXi;
using Eigen::ArrayXXd;
using Eigen::ArrayXXf;
using Eigen::ArrayXXi;
using Eigen::Isometry2d;
using Eigen::Isometry2f;
using Eigen::Isometry3d;
using Eigen::Isometry3f;
using Eigen::Matrix2d;
using Eigen::Matrix2f;
using Eigen::Matrix2i;
using Eigen::Matrix2Xd;
using Eigen::Matrix2Xf;
using Eigen::Matrix2Xi;
using Eigen::Matrix3d;
using Eigen::Matrix3f;
using Eigen::Matrix3i;
using Eigen::Matrix3Xd;
using Eigen::Matrix3Xf;
using Eigen::Matrix3Xi;
using Eigen::Matrix4d;
using Eigen::Matrix4f;
using Eigen::Matrix4i;
using Eigen::Matrix4Xd;
using Eigen::Matrix4Xf;
using Eigen::Matrix4Xi;
using Eigen::MatrixX2d;
using Eigen::MatrixX2f;
using Eigen::MatrixX2i;
using Eigen::MatrixX3d;
using Eigen::MatrixX3f;
using Eigen::MatrixX3i;
using Eigen::MatrixX4d;
using Eigen::MatrixX4f;
using Eigen::MatrixX4i;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::MatrixXi;
using Eigen::Quaterniond;
using Eigen::Quaternionf;
using Eigen::Rotation2Dd;
using Eigen::Rotation2Df;
using Eigen::RowVector2d;
using Eigen::RowVector2f;
using Eigen::RowVector2i;
using Eigen::RowVector3d;
using Eigen::RowVector3f;
using Eigen::RowVector3i;
using Eigen::RowVector4d;
using Eigen::RowVector4f;
using Eigen::RowVector4i;
using Eigen::RowVectorXd;
using Eigen::RowVectorXf;
using Eigen::RowVectorXi;
using Eigen::Translation2d;
using Eigen::Translation2f;
using Eigen::Translation3d;
using Eigen::Translation3f;
using Eigen::Vector2d;
using Eigen::Vector2f;
using Eigen::Vector2i;
using Eigen::Vector3d;
using Eigen::Vector3f;
using Eigen::Vector3i;
using Eigen::Vector4d;
using Eigen::Vector4f;
using Eigen::Vector4i;
using Eigen::VectorXd;
using Eigen::VectorXf;
using Eigen::VectorXi;

}  // namespace Eigen
