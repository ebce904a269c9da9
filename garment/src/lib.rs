//! Sewing patterns to panels, triangulation, seams and placement on a body
