"""`hertzlink explore`: a page in the browser with sliders for a case and the force at a sensor."""
