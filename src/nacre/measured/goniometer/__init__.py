"""Tables of goniometers as laboratories write them: any columns, as text or in a spreadsheet."""
