"""The whole table: plant, firmware and line, tick by tick."""
