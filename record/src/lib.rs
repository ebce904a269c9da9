//! MCAP recording, checkpoint and resume, exports
