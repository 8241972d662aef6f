"""Control of catheters: motions, feedforward, feedback, motors."""
