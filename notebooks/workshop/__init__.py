"""What makes the lessons: their stored form, their pictures, the student's copy, a new lesson."""
