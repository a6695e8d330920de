"""Reading results and signals: waves, events, measures. No simulator is needed."""
