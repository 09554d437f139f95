"""The whole table: plant, firmware and line, computed tick by tick."""
