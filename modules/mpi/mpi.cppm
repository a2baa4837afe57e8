// SPDX-License-Identifier: MIT
//
// cilantro.mpi: processes that share work, on one machine or several.
export module cilantro.mpi;

export import :communicator;
